// A bounded part of the campaign, with any compiler.
#include <gtest/gtest.h>

#include "tests/firmware/lampctl_input.h"
#include "tests/support/fuzz_corpus.h"

namespace darkbox {
namespace {

TEST(LampctlFuzz, TheCorpusHolds) {
    const auto inputs = test::read_corpus(DARKBOX_FUZZ_CORPUS);
    ASSERT_GE(inputs.size(), 10U);
    for (const auto& input : inputs) EXPECT_NO_THROW(test::play_to_lampctl(input.data(), input.size()));
}

TEST(LampctlFuzz, InputsMadeFromItHold) {
    test::FuzzGenerator generator(test::read_corpus(DARKBOX_FUZZ_CORPUS));
    for (long i = 0, inputs = test::fuzz_inputs(200'000); i < inputs; ++i) {
        const auto input = generator.next();
        ASSERT_NO_THROW(test::play_to_lampctl(input.data(), input.size())) << "input " << i;
    }
}

}  // namespace
}  // namespace darkbox
