#include "acquisition/frame/error.h"
#include "processing/transfer/option_checks.h"
#include "processing/transfer/transfer.h"

namespace darkbox {

void TransferOptions::validate() const {
    const OptionChecks checks{"transfer"};
    checks.require_range("window", window, 3, 15);
    checks.require_odd("window", window);
    checks.require_range("coarse_window", coarse_window, 1, 15);
    checks.require_odd("coarse_window", coarse_window);
    checks.require_range("levels", levels, 0, 12);
    checks.require_range("kappa", kappa, 0.0, 25.0);
    checks.require_range("normal_weight", normal_weight, 0.0, 100.0);
    checks.require_range("passes", passes.value_or(0), 0, 64);
    checks.require_range("jitter", jitter, 0.0, 1.0);
    checks.require_range("control_weight", control_weight, 0.0, 100.0);
    checks.require_range("normal_sigma", normal_sigma, 0.0, 64.0);
    if (exact_search && method != TransferMethod::analogies)
        throw InputError("transfer: exact_search is of the method analogies only",
                         "choose that method, or leave it out");
}

}  // namespace darkbox
