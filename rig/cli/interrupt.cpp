#include "rig/cli/interrupt.h"

#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace darkbox {

Interrupt::Interrupt() {
    sigemptyset(&signals_);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) sigaddset(&signals_, signal);
    std::signal(SIGPIPE, SIG_IGN);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    waiter_ = std::jthread([this](const std::stop_token& leave) {
        constexpr timespec slice{0, 50'000'000};
        for (int signals = 0; !leave.stop_requested();) {
            if (sigtimedwait(&signals_, nullptr, &slice) < 0) continue;
            if (++signals == 1) stop_.request_stop();
            if (signals == 2) std::fputs("\nstopping and darkening the lamps; once more ends at once\n", stderr);
            if (signals == 3) std::_Exit(1);
        }
    });
}

Interrupt::~Interrupt() {
    waiter_.request_stop();
    waiter_.join();
    pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr);
}

}  // namespace darkbox
