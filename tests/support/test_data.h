#pragma once

#include <filesystem>
#include <string>

namespace darkbox::test {

/// A folder of the real captures under $DARKBOX_DATA, or an empty path where they are not to be had.
std::filesystem::path real_data(const std::string& folder);

/// An empty folder of its own, removed with all it holds by the destructor.
class TemporaryFolder {
public:
    TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    ~TemporaryFolder();
    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

}  // namespace darkbox::test

/// Skips the running test, visibly, where the real captures are absent.
#define DARKBOX_NEED_DATA(variable, folder)                                  \
    const std::filesystem::path variable = darkbox::test::real_data(folder); \
    if (variable.empty()) GTEST_SKIP() << "set DARKBOX_DATA to the folder that holds " << (folder)
