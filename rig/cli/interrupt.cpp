#include "rig/cli/interrupt.h"

#include <ctime>

namespace darkbox {

Interrupt::Interrupt() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    waiter_ = std::jthread([this](const std::stop_token& leave) {
        constexpr timespec slice{0, 50'000'000};
        while (!leave.stop_requested()) {
            if (sigtimedwait(&signals_, nullptr, &slice) < 0) continue;
            if (stop_.stop_requested()) std::_Exit(1);
            stop_.request_stop();
        }
    });
}

Interrupt::~Interrupt() {
    waiter_.request_stop();
    waiter_.join();
    pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr);
}

}  // namespace darkbox
