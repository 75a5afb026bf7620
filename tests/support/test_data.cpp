#include "tests/support/test_data.h"

#include <unistd.h>

#include <cstdlib>
#include <stdexcept>

namespace darkbox::test {

namespace fs = std::filesystem;

fs::path real_data(const std::string& folder) {
    const char* root = std::getenv("DARKBOX_DATA");
    if (root == nullptr || *root == '\0') return {};
    const fs::path path = fs::path(root) / folder;
    return fs::exists(path) ? path : fs::path();
}

TemporaryFolder::TemporaryFolder() {
    std::string pattern = (fs::temp_directory_path() / "darkbox-test-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("mkdtemp " + pattern);
    path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
}

}  // namespace darkbox::test
