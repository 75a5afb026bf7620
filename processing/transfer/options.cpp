#include <fmt/format.h>

#include "acquisition/frame/error.h"
#include "processing/transfer/transfer.h"

namespace darkbox {
namespace {

template <class Number>
void require_range(const char* field, Number value, Number low, Number high) {
    if (value >= low && value <= high) return;
    throw InputError(fmt::format("transfer: {} is {}, but it must be {}...{}", field, value, low, high),
                     fmt::format("set {} within its range", field));
}

void require_odd(const char* field, int value) {
    if (value % 2 != 0) return;
    throw InputError(fmt::format("transfer: {} is {}, but it must be odd", field, value),
                     fmt::format("set {} to an odd number of pixels, such as 5", field));
}

}  // namespace

void TransferOptions::validate() const {
    require_range("window", window, 3, 15);
    require_odd("window", window);
    require_range("coarse_window", coarse_window, 1, 15);
    require_odd("coarse_window", coarse_window);
    require_range("levels", levels, 0, 12);
    require_range("kappa", kappa, 0.0, 25.0);
    require_range("normal_weight", normal_weight, 0.0, 100.0);
    require_range("passes", passes.value_or(0), 0, 64);
    require_range("jitter", jitter, 0.0, 1.0);
    require_range("control_weight", control_weight, 0.0, 100.0);
    require_range("normal_sigma", normal_sigma, 0.0, 64.0);
    if (exact_search && method != TransferMethod::analogies)
        throw InputError("transfer: exact_search is of the method analogies only",
                         "choose that method, or leave it out");
}

}  // namespace darkbox
