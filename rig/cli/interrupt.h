#pragma once

#include <csignal>
#include <stop_token>
#include <thread>

namespace darkbox {

/// Turns SIGINT, SIGTERM, SIGHUP (a closed terminal) and SIGQUIT into a stop request, so that the command can leave the
/// lamps dark and its session resumable; only the third ends the process at once. A broken pipe is an error of that
/// write, not a signal. Constructed before any other thread starts.
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
