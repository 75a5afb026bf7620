#pragma once

// Boost's networking, included in one place: Boost 1.74 forgets <utility> before awaitable.hpp, and every file that
// names it costs seconds of compiling. Only the HTTP server and the client do.
#include <coroutine>
#include <utility>

// Boost 1.74 knows Clang's coroutines only by their old, experimental name; analysis by Clang needs the standard one.
#if defined(__clang__) && !defined(BOOST_ASIO_HAS_CO_AWAIT)
#define BOOST_ASIO_HAS_CO_AWAIT 1
#define BOOST_ASIO_HAS_STD_COROUTINE 1
#endif

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/system/system_error.hpp>

namespace darkbox {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using UnixProtocol = asio::local::stream_protocol;
/// A connection whose every operation can be given a deadline.
using UnixStream = beast::basic_stream<UnixProtocol, asio::any_io_executor, beast::unlimited_rate_policy>;

}  // namespace darkbox
