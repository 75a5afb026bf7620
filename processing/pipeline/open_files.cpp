#include "processing/pipeline/open_files.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include "acquisition/frame/error.h"

namespace darkbox {

void allow_open_files(std::size_t count) {
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= count) return;
    limit.rlim_cur = count;
    if (limit.rlim_max < count || ::setrlimit(RLIMIT_NOFILE, &limit) != 0)
        throw InputError(fmt::format("{} files would be open at once, but the system allows {}", count, limit.rlim_max),
                         fmt::format("raise the limit with 'ulimit -n {}' as root, or use fewer photographs", count));
}

}  // namespace darkbox
