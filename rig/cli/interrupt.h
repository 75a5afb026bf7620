#pragma once

#include <csignal>
#include <stop_token>
#include <thread>

namespace darkbox {

/// Turns the first SIGINT or SIGTERM into a stop request, so that the command can leave the lamps dark and its session
/// resumable; a second one ends the process at once. Constructed before any other thread starts.
class Interrupt {
public:
    Interrupt();
    Interrupt(const Interrupt&) = delete;
    Interrupt& operator=(const Interrupt&) = delete;
    ~Interrupt();

    std::stop_token token() const { return stop_.get_token(); }

private:
    sigset_t signals_{};
    std::stop_source stop_;
    std::jthread waiter_;
};

}  // namespace darkbox
