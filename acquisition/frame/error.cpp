#include "acquisition/frame/error.h"

namespace darkbox {

// Out of line so that each exception has one vtable in the whole program.
Error::~Error() = default;
InputError::~InputError() = default;
Cancelled::~Cancelled() = default;

}  // namespace darkbox
