#include "processing/pipeline/lit_photos.h"

#include "processing/pipeline/stack.h"

namespace darkbox {

void LitPhotos::rewind() { frames_.emplace(session_, require_lit(session_)); }

}  // namespace darkbox
