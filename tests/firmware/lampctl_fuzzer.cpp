// libFuzzer's entry: ./run fuzz
#include "tests/firmware/lampctl_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
    darkbox::test::play_to_lampctl(bytes, size);
    return 0;
}
