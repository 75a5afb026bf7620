#include "rig/daemon/attempt.h"

#include <new>

#include "acquisition/frame/error.h"

namespace darkbox {

std::optional<Failure> attempt(const std::function<void()>& work) noexcept {
    try {
        work();
        return std::nullopt;
    } catch (const Cancelled& stopped) {
        return Failure{.cancelled = true, .what = stopped.what(), .hint = stopped.hint()};
    } catch (const Error& error) {
        return Failure{.what = error.what(), .hint = error.hint()};
    } catch (const std::bad_alloc&) {
        return Failure{.what = "out of memory", .hint = "close other programs"};
    } catch (const std::exception& error) {
        return Failure{.what = error.what(), .hint = "this is a defect of darkbox; please report it"};
    } catch (...) {
        return Failure{.what = "unknown error", .hint = "this is a defect of darkbox; please report it"};
    }
}

}  // namespace darkbox
