#pragma once

#include <gmock/gmock.h>

#include <string>

#include "acquisition/frame/error.h"

namespace darkbox::test {

/// The InputError's sentence that `act` ends with, or an empty string and a failure when it does not.
template <class Act>
std::string input_error_of(Act&& act) {
    try {
        act();
    } catch (const InputError& error) {
        EXPECT_FALSE(error.hint().empty()) << "an error needs a remedy: " << error.what();
        return error.what();
    }
    ADD_FAILURE() << "no InputError was thrown";
    return {};
}

}  // namespace darkbox::test
