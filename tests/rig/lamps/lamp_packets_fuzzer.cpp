// libFuzzer's entry: ./run fuzz
#include "tests/rig/lamps/lamp_packets_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
    darkbox::test::play_to_lamp_packets(bytes, size);
    return 0;
}
