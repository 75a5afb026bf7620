// A bounded part of the campaign, with any compiler: the kept corpus, and inputs made from it by a seeded generator.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

#include "tests/firmware/lampctl_input.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::vector<Bytes> corpus() {
    std::vector<Bytes> inputs;
    for (const auto& file : std::filesystem::directory_iterator(DARKBOX_FUZZ_CORPUS)) {
        std::ifstream in(file.path(), std::ios::binary);
        inputs.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
    return inputs;
}

TEST(LampctlFuzz, TheCorpusHolds) {
    const auto inputs = corpus();
    ASSERT_GE(inputs.size(), 10U);
    for (const Bytes& input : inputs) EXPECT_NO_THROW(test::play_to_lampctl(input.data(), input.size()));
}

TEST(LampctlFuzz, TwoHundredThousandInputsHold) {
    const auto inputs = corpus();
    std::mt19937 random(20261128);
    const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
    for (int i = 0; i < 200'000; ++i) {
        Bytes input = inputs[below(inputs.size())];
        const Bytes& other = inputs[below(inputs.size())];
        input.resize(below(input.size() + 1));
        input.insert(input.end(), other.begin() + static_cast<std::ptrdiff_t>(below(other.size() + 1)), other.end());
        for (std::size_t changes = below(6); changes > 0 && !input.empty(); --changes)
            input[below(input.size())] = static_cast<std::uint8_t>(below(256));
        ASSERT_NO_THROW(test::play_to_lampctl(input.data(), input.size())) << "input " << i;
    }
}

}  // namespace
}  // namespace darkbox
