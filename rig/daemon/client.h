#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace darkbox {

/// A blocking client of darkboxd's API. Each request is a connection of its own. Thread-compatible.
class DaemonClient {
public:
    using Json = nlohmann::json;

    struct Reply {
        int status = 0;
        Json body;
    };

    enum class Follow { go_on, leave };
    struct Listener {
        std::function<Follow(const Json&)> event;
        std::function<void()> idle = [] {};  ///< a few times a second while nothing happens
    };

    explicit DaemonClient(std::filesystem::path socket, std::chrono::milliseconds deadline = std::chrono::seconds(10));

    const std::filesystem::path& socket() const { return socket_; }
    /// Whether a darkboxd accepts connections there.
    bool answers() const;

    /// `target` without "/api/v1/". Throws DeviceError when the daemon cannot be reached or does not answer in time.
    Reply request(const std::string& method, const std::string& target, const Json& body = nullptr) const;
    /// The body of a reply that is no error; an error's detail and hint become an InputError.
    Json call(const std::string& method, const std::string& target, const Json& body = nullptr) const;

    /// Tells the listener every event after this number until it leaves or the daemon ends the stream.
    /// Throws DeviceError when the daemon falls silent.
    void follow_events(std::uint64_t after, const Listener& listener) const;

private:
    std::filesystem::path socket_;
    std::chrono::milliseconds deadline_;
};

/// $DARKBOX_SOCKET, else $XDG_RUNTIME_DIR/darkbox.sock, else /run/darkbox/darkbox.sock for root. No value when there is
/// none of them: a folder that everybody may write to is no place for it.
std::optional<std::filesystem::path> known_socket();
/// The same; throws InputError where there is none.
std::filesystem::path default_socket();

}  // namespace darkbox
