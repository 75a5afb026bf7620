#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace darkbox::test {

/// A program run by a test, its stdout and stderr in files. The destructor kills it.
class ChildProcess {
public:
    /// `arguments` start with the program's path. Its output goes to LOG.out and LOG.err. The child finds `handed` as
    /// its descriptors from 3 on; their own numbers must lie beyond those.
    ChildProcess(const std::vector<std::string>& arguments, std::filesystem::path log,
                 const std::vector<int>& handed = {});
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;
    ~ChildProcess();

    bool running();
    void signal(int number) const;
    /// The exit status; 128 + N when signal N ended it.
    int wait();
    std::string out() const;
    std::string err() const;

private:
    void ended_with(int wait_status);

    std::filesystem::path log_;
    pid_t pid_ = -1;
    bool ended_ = false;
    int status_ = 0;
};

}  // namespace darkbox::test
