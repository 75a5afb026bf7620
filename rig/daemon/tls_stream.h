#pragma once

#include "rig/daemon/asio.h"

// After asio.h, which makes Boost 1.74 compile.
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>

namespace darkbox {

using TcpStream = beast::basic_stream<asio::ip::tcp, asio::any_io_executor, beast::unlimited_rate_policy>;
using TlsStream = beast::ssl_stream<TcpStream>;

}  // namespace darkbox
