#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace darkbox {

/// Something that happened in the daemon, as its listeners are told. `json` carries "event" (the type) and "number".
struct Event {
    std::uint64_t number = 0;  ///< counted from 1 without gaps since the daemon started
    std::string json;          ///< one line
};

/// The last events, in order. A listener asks for those after a number it knows, so none is missed between a request
/// and listening, and one that is too slow skips the oldest instead of filling the memory.
/// Thread-safe.
class EventLog {
public:
    explicit EventLog(std::size_t capacity = 1024) : capacity_(capacity) {}

    /// `also` hears of every event as it is published, on the thread that does. Set once, before any.
    void tee(std::function<void(const std::string& type, const nlohmann::json& fields)> also) {
        also_ = std::move(also);
    }

    /// Types: "state", "progress", "done", "cancelled", "failed", "lamps", "light", "problem".
    void publish(const std::string& type, nlohmann::json fields);
    std::vector<Event> after(std::uint64_t number) const;
    std::uint64_t last() const;

    /// No more events will come; listeners leave once they have read what is there.
    void close();
    bool closed() const;

    /// `notify` is called after every publish() and close(), on the thread that called it. It must be quick, and
    /// harmless at any moment until it is replaced. An empty function unsubscribes.
    void on_change(std::function<void()> notify);

private:
    void notify() const;

    const std::size_t capacity_;
    mutable std::mutex mutex_;
    std::deque<Event> events_;  // guarded by mutex_
    std::uint64_t last_ = 0;    // guarded by mutex_
    bool closed_ = false;       // guarded by mutex_
    std::function<void(const std::string&, const nlohmann::json&)> also_;
    mutable std::mutex notify_mutex_;
    std::function<void()> notify_;  // guarded by notify_mutex_
};

}  // namespace darkbox
