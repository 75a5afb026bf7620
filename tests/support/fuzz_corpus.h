#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

namespace darkbox::test {

using FuzzInput = std::vector<std::uint8_t>;

inline std::vector<FuzzInput> read_corpus(const std::filesystem::path& folder) {
    std::vector<FuzzInput> inputs;
    for (const auto& file : std::filesystem::directory_iterator(folder)) {
        std::ifstream in(file.path(), std::ios::binary);
        inputs.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
    return inputs;
}

/// How many inputs a test makes: what $DARKBOX_FUZZ_INPUTS says, or so many.
inline long fuzz_inputs(long otherwise) {
    const char* asked = std::getenv("DARKBOX_FUZZ_INPUTS");
    return asked != nullptr ? std::stol(asked) : otherwise;
}

/// Inputs made from a corpus by a seeded generator: the beginning of one, the end of another, some bytes changed. What
/// is left of libFuzzer where there is no Clang.
class FuzzGenerator {
public:
    explicit FuzzGenerator(std::vector<FuzzInput> corpus) : corpus_(std::move(corpus)) {}

    FuzzInput next() {
        FuzzInput input = corpus_[below(corpus_.size())];
        const FuzzInput& other = corpus_[below(corpus_.size())];
        input.resize(below(input.size() + 1));
        input.insert(input.end(), other.begin() + static_cast<std::ptrdiff_t>(below(other.size() + 1)), other.end());
        for (std::size_t changes = below(6); changes > 0 && !input.empty(); --changes)
            input[below(input.size())] = static_cast<std::uint8_t>(below(256));
        return input;
    }

private:
    std::size_t below(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_); }

    std::vector<FuzzInput> corpus_;
    std::mt19937 random_{20261128};
};

}  // namespace darkbox::test
