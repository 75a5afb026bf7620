#pragma once

#include <stdexcept>
#include <string>

namespace darkbox {

/// What a person sees when something fails: what() says what was wrong and where, hint() says what to do.
/// Thrown for what the caller cannot expect; caught once, at the command or the service.
class Error : public std::runtime_error {
public:
    Error(const std::string& what, std::string hint) : std::runtime_error(what), hint_(std::move(hint)) {}
    ~Error() override;

    const std::string& hint() const noexcept { return hint_; }

private:
    std::string hint_;
};

/// The input (a file, an option, a configuration, a scene that cannot be solved) is at fault.
class InputError : public Error {
public:
    using Error::Error;
    ~InputError() override;
};

/// The user or a signal asked for the work to stop. Not a failure: everything acknowledged is kept.
class Cancelled : public Error {
public:
    using Error::Error;
    ~Cancelled() override;
};

}  // namespace darkbox
