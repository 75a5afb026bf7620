#include "rig/cli/capture_series.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <iterator>
#include <sstream>
#include <thread>

#include "acquisition/device/device_error.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(SplitWordsTest, PartsAndQuotesAndExpandsNothing) {
    EXPECT_THAT(split_words("  ./turn.sh 15\tdeg "), ElementsAre("./turn.sh", "15", "deg"));
    EXPECT_THAT(split_words(R"(a "b c" 'd "e' f\ g "" h"i"'j')"), ElementsAre("a", "b c", "d \"e", "f g", "", "hij"));
    EXPECT_THAT(split_words(R"("a\"b\\c\d" '\')"), ElementsAre(R"(a"b\c\d)", R"(\)"));
    EXPECT_THAT(split_words("$HOME *.png a;b|c >d $(e) `f`"),
                ElementsAre("$HOME", "*.png", "a;b|c", ">d", "$(e)", "`f`"));
    EXPECT_THAT(input_error_of([] { split_words("a 'b"); }), HasSubstr("quote"));
    EXPECT_THAT(input_error_of([] { split_words(" "); }), HasSubstr("empty"));
}

class HookTest : public testing::Test {
protected:
    fs::path script(const std::string& text) const {
        const fs::path file = folder_.path() / "hook.sh";
        std::ofstream(file) << "#!/bin/sh\n" << text << "\n";
        fs::permissions(file, fs::perms::owner_all);
        return file;
    }
    std::string left(const std::string& name) const {
        std::ifstream in(folder_.path() / name);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    static std::string failure_of(const Hook& hook) {
        try {
            run_hook(hook, {}, {});
        } catch (const DeviceError& error) {
            return error.what();
        }
        return "";
    }
    TemporaryFolder folder_;
};

TEST_F(HookTest, GetsItsWordsAndItsEnvironmentAsTheyAre) {
    const fs::path out = folder_.path() / "out";
    run_hook({{script("printf '%s|' \"$#\" \"$1\" \"$2\" \"$DARKBOX_SESSION\" >" + out.string()), "a; $(b)", ""}},
             {{"DARKBOX_SESSION", "a 'vase'"}}, {});
    EXPECT_EQ(left("out"), "2|a; $(b)||a 'vase'|");
}

TEST_F(HookTest, SaysHowItFailed) {
    EXPECT_THAT(failure_of({{script("exit 7")}}), AllOf(HasSubstr("hook.sh"), HasSubstr("failed with status 7")));
    EXPECT_THAT(failure_of({{script("kill -KILL $$")}}), HasSubstr("ended by signal 9"));
    EXPECT_THAT(failure_of({{"/nowhere/turn.sh"}}), HasSubstr("/nowhere/turn.sh"));
}

TEST_F(HookTest, IsEndedWithItsChildrenAtTheDeadline) {
    const Hook hook{{script("sleep 1000 & echo $! >" + (folder_.path() / "child").string() + "; wait")}, 1s};
    EXPECT_THAT(failure_of(hook), HasSubstr("was not done after 1 s"));
    const pid_t child = std::stoi(left("child"));
    while (::kill(child, 0) == 0) {  // until whoever inherited it has taken note; for ever if it was not ended
        std::ifstream in("/proc/" + std::to_string(child) + "/stat");
        const std::string stat{std::istreambuf_iterator<char>(in), {}};
        if (stat.find(") Z") != std::string::npos) break;
        std::this_thread::sleep_for(10ms);
    }
}

TEST_F(HookTest, StopsWhenAsked) {
    std::stop_source stop;
    std::jthread asks([&] {
        while (left("begun").empty()) std::this_thread::sleep_for(10ms);
        stop.request_stop();
    });
    EXPECT_THROW(run_hook({{script("echo x >" + (folder_.path() / "begun").string() + "; sleep 1000")}, 1000s}, {},
                          stop.get_token()),
                 Cancelled);
}

CommandResult captured(const fs::path& session) {
    CommandResult result;
    result.json = {{"session", session.string()}};
    result.text = session.string();
    return result;
}

TEST_F(HookTest, RunsBetweenTheCapturesOfASeries) {
    const fs::path log = folder_.path() / "log";
    const auto names = numbered_names("turn", 3);
    const CaptureSeries series{
        .object = "vase",
        .between =
            Hook{{script("echo $DARKBOX_SESSION $DARKBOX_NEXT $DARKBOX_CAPTURED/$DARKBOX_REPEAT $DARKBOX_OBJECT >>" +
                         log.string())}}};
    const CommandResult result = capture_series(series, names, captured, {});
    EXPECT_EQ(left("log"), "turn-001 turn-002 1/3 vase\nturn-002 turn-003 2/3 vase\n");
    EXPECT_EQ(result.json.at("captures").size(), 3U);
    EXPECT_EQ(result.text, "turn-001\nturn-002\nturn-003");
}

TEST_F(HookTest, ItsFailureEndsTheSeries) {
    int captures = 0;
    const CaptureInto count = [&](const fs::path& session) {
        ++captures;
        return captured(session);
    };
    const CaptureSeries series{.object = "", .between = Hook{{script("test $DARKBOX_CAPTURED -lt 2")}}};
    try {
        capture_series(series, numbered_names("turn", 5), count, {});
        FAIL() << "it went on";
    } catch (const DeviceError& error) {
        EXPECT_THAT(error.what(), AllOf(HasSubstr("after capture 2 of 5"), HasSubstr("hook.sh")));
    }
    EXPECT_EQ(captures, 2);
}

TEST(CaptureSeriesTest, NumbersNames) {
    EXPECT_THAT(numbered_names("a/vase/", 2), ElementsAre("a/vase-001", "a/vase-002"));
    EXPECT_EQ(numbered_names("v", 1000).back(), "v-1000");
    EXPECT_EQ(numbered_names("v", 1000).front(), "v-0001");
}

TEST(CaptureSeriesTest, ACapturesFailureNamesItsPlace) {
    const CaptureInto fails = [](const fs::path&) -> CommandResult { throw InputError("no lamp", "plug it in"); };
    EXPECT_THAT(input_error_of([&] { capture_series({}, numbered_names("v", 2), fails, {}); }),
                testing::StrEq("capture 1 of 2: no lamp"));
}

}  // namespace
}  // namespace darkbox
