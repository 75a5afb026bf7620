#include "rig/lamps/lamp_controller.h"

#include <fmt/format.h>

#include <utility>

#include "acquisition/device/clock.h"
#include "acquisition/device/device_error.h"

namespace darkbox {

using namespace lamp_protocol;

namespace {

constexpr int beats_in_a_heartbeat = 4;
constexpr std::size_t most_events_kept = 4096;

TimePoint now() { return SystemClock().now(); }

}  // namespace

LampController::LampController(LampControllerOptions options) : options_(std::move(options)) {
    connect(bus_.open(options_.serial));
    heart_ = std::thread([this] { beat(); });
}

LampController::~LampController() {
    {
        const std::lock_guard lock(state_);
        ends_ = true;
    }
    changed_.notify_all();
    if (heart_.joinable()) heart_.join();
    try {
        dark_by_request();
    } catch (const Error&) {  // NOLINT(bugprone-empty-catch): the board hears nothing more, and darkens by itself
    }
    link_.reset();  // while what its packets go to is still here
}

UsbLink& LampController::link() const {
    if (!link_) throw DeviceError("the lamp controller is gone", "check its cable and its supply");
    return *link_;
}

void LampController::connect(UsbBus::Handle handle) {
    {
        const std::lock_guard lock(state_);
        clock_.forget();
        last_number_.reset();
    }
    link_ = std::make_unique<UsbLink>(std::move(handle),
                                      [this](std::span<const std::uint8_t> packet) { on_packet(packet); });
    check_version();
    link_->write(Request::dark, 0, {}, options_.patience);
    link_->clear_halts();
    exchange(Command::clear_faults, lamp_payload(ClearCommand{0xFF, {}}));
}

void LampController::check_version() {
    const auto info = parse_lamp_info(link().read(Request::info, sizeof(Info), options_.patience));
    if (!info)
        throw DeviceError("what is plugged in does not answer as a lamp controller",
                          "unplug it, or flash it: darkbox lamps flash");
    if (const auto refusal = version_refusal(*info))
        throw DeviceError(*refusal, "flash the firmware that came with this darkbox: darkbox lamps flash");
    info_ = *info;
}

void LampController::reconnect() {
    const std::lock_guard lock(commands_);
    link_.reset();
    connect(bus_.open_within(options_.serial, options_.replug_patience));
}

bool LampController::gone() const { return !link_ || link_->gone(); }

Info LampController::info() const { return info_; }

Identity LampController::identity() const {
    const auto identity = parse_lamp_identity(link().read(Request::identity, sizeof(Identity), options_.patience));
    if (!identity)
        throw DeviceError("the lamp controller has no valid identity", "darkbox lamps flash --serial NAME stores one");
    return *identity;
}

Status LampController::status() const {
    const auto status = parse_lamp_status(link().read(Request::status, sizeof(Status), options_.patience));
    if (!status) throw DeviceError("the lamp controller's status cannot be read", "unplug it and plug it in again");
    return *status;
}

void LampController::dark_by_request() { link().write(Request::dark, 0, {}, options_.patience); }

void LampController::store_identity(const Identity& identity) {
    link().write(Request::set_identity, identity_key, lamp_payload(identity), options_.patience);
}

void LampController::start_bootloader() { link().write(Request::bootloader, bootloader_key, {}, options_.patience); }

void LampController::on_packet(std::span<const std::uint8_t> packet) {
    const auto event = parse_lamp_event(packet);
    if (!event) return;
    const std::lock_guard lock(state_);
    if (last_number_) events_lost_ += static_cast<std::uint8_t>(event->number - *last_number_ - 1);
    last_number_ = event->number;
    if (event->kind == EventKind::reply) {
        if (event->sequence == awaited_) reply_ = event;
    } else {
        if (events_.size() == most_events_kept) events_.pop_front();
        events_.push_back({*event, clock_.map(event->time_us)});
    }
    changed_.notify_all();
}

Event LampController::wait_for_reply(std::uint8_t sequence, TimePoint sent) {
    constexpr auto look_again = std::chrono::milliseconds(20);
    std::unique_lock lock(state_);
    while (!reply_ && !link().stalled() && now() < sent + options_.patience) changed_.wait_for(lock, look_again);
    if (!reply_)
        throw DeadlineError(fmt::format("the lamp controller did not reply to command {}", sequence),
                            "unplug it and plug it in again");
    clock_.exchange(sent, now(), reply_->time_us);
    return *std::exchange(reply_, std::nullopt);
}

Event LampController::exchange(Command name, std::span<const std::uint8_t> payload) {
    if (++sequence_ == 0) ++sequence_;
    {
        const std::lock_guard lock(state_);
        awaited_ = sequence_;
        reply_.reset();
    }
    const TimePoint sent = now();
    link().send(lamp_packet(name, sequence_, payload), options_.patience);
    return wait_for_reply(sequence_, sent);
}

Event LampController::command(Command name, std::span<const std::uint8_t> payload) {
    const std::lock_guard lock(commands_);
    Event reply{};
    try {
        reply = exchange(name, payload);
    } catch (const DeviceError&) {
        if (gone()) throw;
        link().clear_halts();  // a stall, or a reply that was lost: every command may be said twice
        reply = exchange(name, payload);
    }
    if (static_cast<Outcome>(reply.code) != Outcome::done)
        throw DeviceError(fmt::format("the lamp controller refused: {}", outcome_in_words(reply)),
                          static_cast<Outcome>(reply.code) == Outcome::lamp_rests
                              ? "let the lamp rest, or raise max_on_s or max_duty if it bears that"
                              : "see docs/lamp-controller.md");
    return reply;
}

void LampController::beat() {
    std::unique_lock lock(state_);
    while (!changed_.wait_for(lock, options_.heartbeat / beats_in_a_heartbeat, [this] { return ends_; })) {
        lock.unlock();
        try {
            const std::lock_guard one(commands_);
            if (!gone()) exchange(Command::heartbeat, {});
        } catch (const Error&) {  // NOLINT(bugprone-empty-catch): who drives the lamps finds out, and says it better
        }
        lock.lock();
    }
}

std::optional<LampEvent> LampController::next_event(TimePoint deadline) {
    std::unique_lock lock(state_);
    constexpr auto look_again = std::chrono::milliseconds(20);
    while (events_.empty()) {
        const Nanoseconds left = deadline - now();
        if (left <= Nanoseconds(0) || gone()) return std::nullopt;
        changed_.wait_for(lock, std::min<Nanoseconds>(left, look_again));
    }
    LampEvent event = events_.front();
    events_.pop_front();
    if (!event.when) event.when = clock_.map(event.raw.time_us);
    return event;
}

void LampController::forget_events() {
    const std::lock_guard lock(state_);
    events_.clear();
}

std::uint64_t LampController::events_lost() const {
    const std::lock_guard lock(state_);
    return events_lost_;
}

}  // namespace darkbox
