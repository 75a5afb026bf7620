#include "rig/daemon/events.h"

namespace darkbox {

void EventLog::publish(const std::string& type, nlohmann::json fields) {
    if (also_) also_(type, fields);
    {
        const std::scoped_lock lock(mutex_);
        fields["event"] = type;
        fields["number"] = ++last_;
        events_.push_back({last_, fields.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)});
        if (events_.size() > capacity_) events_.pop_front();
    }
    notify();
}

std::vector<Event> EventLog::after(std::uint64_t number) const {
    const std::scoped_lock lock(mutex_);
    const std::uint64_t first = last_ - events_.size() + 1;
    if (number >= last_) return {};
    const std::uint64_t skip = number + 1 > first ? number + 1 - first : 0;
    return {events_.begin() + static_cast<std::ptrdiff_t>(skip), events_.end()};
}

std::uint64_t EventLog::last() const {
    const std::scoped_lock lock(mutex_);
    return last_;
}

void EventLog::close() {
    {
        const std::scoped_lock lock(mutex_);
        closed_ = true;
    }
    notify();
}

bool EventLog::closed() const {
    const std::scoped_lock lock(mutex_);
    return closed_;
}

void EventLog::on_change(std::function<void()> notify) {
    const std::scoped_lock lock(notify_mutex_);
    notify_ = std::move(notify);
}

void EventLog::notify() const {
    const std::scoped_lock lock(notify_mutex_);
    if (notify_) notify_();
}

}  // namespace darkbox
