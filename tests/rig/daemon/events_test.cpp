#include "rig/daemon/events.h"

#include <gtest/gtest.h>

namespace darkbox {
namespace {

std::vector<std::uint64_t> numbers(const std::vector<Event>& events) {
    std::vector<std::uint64_t> result;
    for (const Event& event : events) result.push_back(event.number);
    return result;
}

TEST(EventLog, GivesWhatComesAfterANumber) {
    EventLog log;
    EXPECT_TRUE(log.after(0).empty());
    for (int i = 0; i < 3; ++i) log.publish("state", {{"i", i}});
    EXPECT_EQ(numbers(log.after(0)), (std::vector<std::uint64_t>{1, 2, 3}));
    EXPECT_EQ(numbers(log.after(2)), (std::vector<std::uint64_t>{3}));
    EXPECT_TRUE(log.after(3).empty());
    EXPECT_TRUE(log.after(99).empty());
    EXPECT_TRUE(log.after(UINT64_MAX).empty());
    EXPECT_EQ(nlohmann::json::parse(log.after(2).front().json),
              (nlohmann::json{{"event", "state"}, {"number", 3}, {"i", 2}}));
}

TEST(EventLog, ForgetsTheOldestBeyondItsCapacity) {
    EventLog log(2);
    for (int i = 0; i < 5; ++i) log.publish("progress", nlohmann::json::object());
    EXPECT_EQ(log.last(), 5u);
    EXPECT_EQ(numbers(log.after(0)), (std::vector<std::uint64_t>{4, 5}));
    EXPECT_EQ(numbers(log.after(4)), (std::vector<std::uint64_t>{5}));
}

TEST(EventLog, NotifiesOfEventsAndOfTheEnd) {
    EventLog log;
    int calls = 0;
    log.on_change([&] { ++calls; });
    log.publish("state", nlohmann::json::object());
    EXPECT_FALSE(log.closed());
    log.close();
    EXPECT_TRUE(log.closed());
    EXPECT_EQ(calls, 2);
    log.on_change({});
    log.publish("state", nlohmann::json::object());
    EXPECT_EQ(calls, 2);
}

TEST(EventLog, IsOneLineWhateverTheTextHolds) {
    EventLog log;
    log.publish("failed", {{"detail", "two\nlines and a broken \xff byte"}});
    const std::string line = log.after(0).front().json;
    EXPECT_EQ(line.find('\n'), std::string::npos);
    EXPECT_TRUE(nlohmann::json::accept(line));
}

}  // namespace
}  // namespace darkbox
