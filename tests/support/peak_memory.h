#pragma once

#include <malloc.h>

#include <fstream>
#include <optional>
#include <string>

namespace darkbox::test {

/// How much memory some work takes at its worst, beyond what the process held before. No value where the kernel does
/// not let the peak be forgotten, and under sanitizers, whose shadow memory counts too.
class PeakMemory {
public:
    PeakMemory() {
        malloc_trim(0);  // else what earlier work left unused would be taken again, and not counted
        std::ofstream("/proc/self/clear_refs") << "5";
        before_kib_ = kib_of("VmRSS:");
        told_ = kib_of("VmHWM:") < before_kib_ + 1024;
    }

    std::optional<double> mib() const {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
        return std::nullopt;
#else
        if (!told_) return std::nullopt;
        return (kib_of("VmHWM:") - before_kib_) / 1024;
#endif
    }

private:
    static double kib_of(const std::string& name) {
        std::ifstream status("/proc/self/status");
        for (std::string word; status >> word;)
            if (double kib = 0; word == name && status >> kib) return kib;
        return 0;
    }

    double before_kib_ = 0;
    bool told_ = false;
};

}  // namespace darkbox::test
