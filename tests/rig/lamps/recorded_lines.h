#pragma once

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <new>
#include <thread>
#include <vector>

#include "acquisition/device/device_error.h"
#include "rig/lamps/gpio_lines.h"

namespace darkbox::test {

/// What the lines of a chip did, seen by every process that was forked after it was made.
struct LineRecord {
    static constexpr std::size_t most_sets = 4096;

    std::atomic<std::uint64_t> active = 0;  ///< bit i: line i; stays as it was when its holder dies
    std::atomic<bool> held = false;
    std::atomic<std::uint32_t> holder = 0;  ///< process that requested them last
    std::atomic<int> requests = 0;
    std::atomic<bool> plugged = true;
    std::atomic<int> failing_sets = 0;      ///< so many fail before the next works
    std::atomic<int> failing_requests = 0;  ///< likewise
    std::atomic<std::uint32_t> sets = 0;
    std::array<std::atomic<std::uint64_t>, most_sets> set{};

    bool was_ever(std::uint64_t value) const {
        for (std::uint32_t i = 0; i < sets; ++i)
            if (set.at(i) == value) return true;
        return false;
    }
    std::vector<std::uint64_t> all_sets() const { return {set.begin(), set.begin() + sets}; }
};

/// A GPIO chip in shared memory.
class RecordedChip {
public:
    RecordedChip()
        : record_(new(::mmap(nullptr, sizeof(LineRecord), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0))
                      LineRecord) {}
    RecordedChip(const RecordedChip&) = delete;
    RecordedChip& operator=(const RecordedChip&) = delete;
    ~RecordedChip() { ::munmap(record_, sizeof(LineRecord)); }

    LineRecord& record() { return *record_; }

    RequestLines request() {
        return [this](const GpioRequest&) -> std::unique_ptr<OutputLines> {
            if (!record_->plugged) throw DeviceError("there is no GPIO chip with the label \"bench\"", "plug it in");
            if (takes_one_of(record_->failing_requests)) throw_errno("request lines of GPIO chip", "\"bench\"", EIO);
            return std::make_unique<Lines>(*record_);
        };
    }

private:
    static bool takes_one_of(std::atomic<int>& failures) { return failures > 0 && failures-- > 0; }

    class Lines final : public OutputLines {
    public:
        explicit Lines(LineRecord& record) : record_(record) {
            record_.holder = static_cast<std::uint32_t>(::getpid());
            record_.active = 0;
            record_.held = true;
            ++record_.requests;
        }
        Lines(const Lines&) = delete;
        Lines& operator=(const Lines&) = delete;
        ~Lines() override { record_.held = false; }

        void set(const std::vector<bool>& active) override {
            if (!record_.plugged) throw_errno("set lines of GPIO chip", "\"bench\"", ENODEV);
            if (takes_one_of(record_.failing_sets)) throw_errno("set lines of GPIO chip", "\"bench\"", EIO);
            std::uint64_t value = 0;
            for (std::size_t i = 0; i < active.size(); ++i) value |= std::uint64_t{active[i]} << i;
            record_.active = value;
            record_.set.at(record_.sets) = value;
            ++record_.sets;
        }

    private:
        LineRecord& record_;
    };

    LineRecord* record_;
};

/// Waits for what another process will do, for as long as a loaded machine may need.
inline bool comes_true(const std::function<bool()>& condition) {
    for (int i = 0; i < 20'000; ++i) {
        if (condition()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

}  // namespace darkbox::test
