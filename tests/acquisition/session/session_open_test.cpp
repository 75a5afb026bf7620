#include <gmock/gmock.h>
#include <sys/stat.h>

#include "acquisition/session/sha256.h"
#include "tests/acquisition/session/session_fixture.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using namespace test;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;

class Open : public testing::Test {
protected:
    Open() { written_session(folder, 3).seal(); }

    std::string open_failure() const {
        return failure_of<InputError>([this] { Session::open(folder); });
    }
    std::string verify_failure() const {
        const Session session = Session::open(folder);
        return failure_of<InputError>([&] { session.verify(); });
    }

    TemporaryFolder temporary;
    fs::path folder = temporary.path() / "session";
    fs::path document = folder / "data/session.json";
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    if (at == std::string::npos) throw std::logic_error("not in session.json: " + from);
    return text.replace(at, from.size(), to);
}

TEST_F(Open, WhatIsNoSessionIsSaidToBeNone) {
    const auto failure = [](const fs::path& path) { return failure_of<InputError>([&] { Session::open(path); }); };
    EXPECT_THAT(failure(temporary.path() / "absent"), HasSubstr("not a folder"));
    EXPECT_THAT(failure(document), HasSubstr("not a folder"));
    EXPECT_THAT(failure(temporary.path()), HasSubstr("not a session"));
    fs::remove(folder / "bagit.txt");
    EXPECT_THAT(open_failure(), AllOf(HasSubstr("bagit.txt"), HasSubstr("missing")));
    write_file(folder / "bagit.txt", "hello\n");
    EXPECT_THAT(open_failure(), HasSubstr("BagIt"));
}

TEST_F(Open, AnUnsealedSessionIsToldApart) {
    const fs::path unsealed = temporary.path() / "unsealed";
    {
        const SessionWriter writer = written_session(unsealed, 1);
    }
    EXPECT_THAT(failure_of<InputError>([&] { Session::open(unsealed); }),
                HasSubstr("darkbox capture --resume " + unsealed.string()));
    const fs::path import = temporary.path() / "import";
    SessionInfo info = capture_info(1);
    info.source = "import";
    {
        const SessionWriter writer = SessionWriter::create(import, info);
    }
    EXPECT_THAT(failure_of<InputError>([&] { Session::open(import); }), HasSubstr("import the pictures again"));
}

TEST_F(Open, GeometryIsKeptAndMayBeAbsent) {
    EXPECT_FALSE(Session::open(folder).info().geometry);
    SessionInfo info = capture_info(0);
    info.geometry.emplace();
    info.geometry->mm_per_pixel = 0.25;
    info.geometry->camera_distance_mm = 800;
    info.geometry->principal_px = {159.5, 119.25};
    info.geometry->ball_diameter_mm = 36;
    info.geometry->distant_lamps = true;
    info.geometry->lamps = {{"lamp-0", {100, -200, 900.5}}};
    const fs::path other = temporary.path() / "other";
    SessionWriter::create(other, info).seal();
    EXPECT_EQ(Session::open(other).info().geometry, info.geometry);

    const fs::path file = other / "data/session.json";
    const std::string text = read_file(file);
    for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
             {"\"mm_per_pixel\": 0.25", "\"mm_per_pixel\": 0"},
             {"\"mm_per_pixel\": 0.25", "\"mm_per_pixel\": -1e999"},
             {"\"mm_per_pixel\": 0.25", "\"mm_per_pixel\": \"0.25\""},
             {"\"camera_distance_mm\": 800.0", "\"camera_distance_mm\": -800.0"},
             {"\"ball_diameter_mm\": 36.0", "\"ball_diameter_mm\": null"},
             {"159.5,", "\"159.5\","},
             {"159.5,", "159.5, 1,"},
             {"900.5", "900.5, 4"},
             {"\"distant_lamps\": true", "\"distant_lamps\": 1"},
             {"\"name\": \"lamp-0\"", "\"name\": 0"}}) {
        write_file(file, replaced(text, from, to));
        EXPECT_THAT(failure_of<InputError>([&] { Session::open(other); }), HasSubstr("session.json")) << to;
    }
}

struct Hostile {
    const char* what;
    const char* from;
    const char* to;
};

TEST_F(Open, HostileDocumentsAreOneInputError) {
    constexpr const char* file = "\"file\": \"frames/0000_lamp-0.tif\"";
    constexpr const char* width = "\"width\": 16";
    constexpr const char* lamp = "\"lamp\": 0";
    const Hostile table[] = {
        {"version 2", "\"schema_version\": 1", "\"schema_version\": 2"},
        {"version text", "\"schema_version\": 1", "\"schema_version\": \"1\""},
        {"version absent", "\"schema_version\": 1", "\"schema\": 1"},
        {"width text", width, "\"width\": \"16\""},
        {"width null", width, "\"width\": null"},
        {"width negative", width, "\"width\": -16"},
        {"width zero", width, "\"width\": 0"},
        {"width fraction", width, "\"width\": 16.5"},
        {"width absurd", width, "\"width\": 2000000000"},
        {"width beyond 64 bits", width, "\"width\": 99999999999999999999999"},
        {"width infinite", width, "\"width\": 1e999"},
        {"width absent", width, "\"breadth\": 16"},
        {"width list", width, "\"width\": [16]"},
        {"depth absurd", "\"bit_depth\": 12", "\"bit_depth\": 64"},
        {"black level text", "\"black_level\": 64.5", "\"black_level\": \"64.5\""},
        {"black level negative", "\"black_level\": 64.5", "\"black_level\": -1"},
        {"kind unknown", "\"kind\": \"lit\"", "\"kind\": \"bright\""},
        {"kind number", "\"kind\": \"lit\"", "\"kind\": 0"},
        {"curve unknown", "\"transfer\": \"linear\"", "\"transfer\": \"log\""},
        {"format empty", "\"format\": \"grey16\"", "\"format\": \"\""},
        {"format odd", "\"format\": \"grey16\"", "\"format\": \"../x\""},
        {"lamp negative", lamp, "\"lamp\": -1"},
        {"lamp too large", lamp, "\"lamp\": 4294967296"},
        {"lamp text", lamp, "\"lamp\": \"0\""},
        {"verified number", "\"verified\": true", "\"verified\": 1"},
        {"sequence negative", "\"sequence\": 0", "\"sequence\": -1"},
        {"time too large", "\"lamp_on_ns\": 1000", "\"lamp_on_ns\": 9223372036854775808"},
        {"path up", file, "\"file\": \"../../../etc/passwd\""},
        {"path up inside", file, "\"file\": \"frames/../../../etc/passwd\""},
        {"path absolute", file, "\"file\": \"/etc/passwd\""},
        {"path empty", file, "\"file\": \"\""},
        {"path dot", file, "\"file\": \"./frames/0000_lamp-0.tif\""},
        {"path double slash", file, "\"file\": \"frames//0000_lamp-0.tif\""},
        {"path with NUL", file, "\"file\": \"frames/0000_lamp-0.tif\\u0000\""},
        {"path not UTF-8", file, "\"file\": \"frames/\xFF.tif\""},
        {"path not listed", file, "\"file\": \"frames/other.tif\""},
        {"path of another frame", file, "\"file\": \"frames/0001_lamp-1.tif\""},
        {"path number", file, "\"file\": 7"},
        {"checksum short", "\"sha256\": \"", "\"sha256\": \"0\", \"rest\": \""},
        {"frames object", "\"frames\": [", "\"frames\": {}, \"rest\": ["},
        {"frames number", "\"frames\": [", "\"frames\": 3, \"rest\": ["},
        {"frames of texts", "\"frames\": [", "\"frames\": [\"x\"], \"rest\": ["},
        {"frames nested", "\"frames\": [", "\"frames\": [[[[[]]]]], \"rest\": ["},
        {"events text", "\"events\": [", "\"events\": \"none\", \"rest\": ["},
        {"events of numbers", "\"events\": [", "\"events\": [1], \"rest\": ["},
        {"notes of numbers", "\"notes\": [", "\"notes\": [1,"},
        {"planned text", "\"planned_shots\": 3", "\"planned_shots\": \"3\""},
        {"planned negative", "\"planned_shots\": 3", "\"planned_shots\": -3"},
        {"planned absurd", "\"planned_shots\": 3", "\"planned_shots\": 2000000000"},
        {"session list", "\"session\": {", "\"session\": [], \"rest\": {"},
        {"object number", "\"object\": \"a brick\"", "\"object\": 1"},
    };
    const std::string good = read_file(document);
    for (const Hostile& hostile : table) {
        write_file(document, replaced(good, hostile.from, hostile.to));
        EXPECT_THAT(open_failure(), HasSubstr(document.string())) << hostile.what;
    }
    write_file(document, good);
    EXPECT_EQ(open_failure(), "");
}

TEST_F(Open, TextsThatAreNoDocumentAreOneInputError) {
    const std::string opening(1'000'000, '[');
    std::string objects;
    for (int i = 0; i < 100'000; ++i) objects += "{\"a\":";
    for (const std::string& text : {std::string(), std::string("null"), std::string("[]"), std::string("{}"),
                                    std::string("{"), std::string("\0\0\0", 3), std::string("\xFF\xFE{}"), opening,
                                    objects, std::string(1000, '"'), std::string("{\"schema_version\": 1}")}) {
        write_file(document, text);
        EXPECT_THAT(open_failure(), HasSubstr(document.string())) << text.substr(0, 20);
    }
}

TEST_F(Open, ADocumentCutAnywhereIsOneInputError) {
    const std::string good = read_file(document);
    for (std::size_t length = 0; length + 1 < good.size(); ++length) {
        write_file(document, good.substr(0, length));
        ASSERT_NE(open_failure(), "") << length;
    }
}

TEST_F(Open, HostileManifestsAreOneInputError) {
    const fs::path manifest = folder / "manifest-sha256.txt";
    const std::string good = read_file(manifest);
    const std::string hash = sha256_hex({});
    for (const std::string& line :
         {hash + "  data/../../secret\n", hash + "  /etc/passwd\n", hash + "  data//etc/passwd\n", hash + "  data/\n",
          hash + "  outside.txt\n", hash + "  data/a%0A/../b\n", hash + "\n", hash + " data/x\n",
          std::string("short  data/x\n"), std::string("\n"), std::string(64, 'g') + "  data/x\n",
          good.substr(0, good.find('\n') + 1)}) {
        write_file(manifest, good + line);
        EXPECT_THAT(open_failure(), HasSubstr(manifest.string())) << line;
    }
    const fs::path tags = folder / "tagmanifest-sha256.txt";
    write_file(manifest, good);
    write_file(tags, read_file(tags) + hash + "  ../../secret\n");
    EXPECT_THAT(open_failure(), HasSubstr(tags.string()));
}

TEST_F(Open, LinksOutOfTheFolderAreRefused) {
    const fs::path frame = folder / "data/frames/0001_lamp-1.tif";
    const fs::path outside = temporary.path() / "outside";
    fs::create_directories(outside);

    fs::rename(frame, outside / "frame.tif");
    fs::create_symlink(outside / "frame.tif", frame);
    EXPECT_THAT(open_failure(), AllOf(HasSubstr(frame.string()), HasSubstr("link")));
    fs::remove(frame);
    fs::rename(outside / "frame.tif", frame);

    fs::rename(folder / "data/frames", outside / "frames");
    fs::create_directory_symlink(outside / "frames", folder / "data/frames");
    EXPECT_THAT(open_failure(), AllOf(HasSubstr("data/frames"), HasSubstr("link")));
    fs::remove(folder / "data/frames");
    fs::rename(outside / "frames", folder / "data/frames");

    fs::rename(document, outside / "session.json");
    ASSERT_EQ(::mkfifo(document.c_str(), 0600), 0);
    EXPECT_THAT(open_failure(), AllOf(HasSubstr(document.string()), HasSubstr("not a regular file")));
    fs::remove(document);
    fs::rename(outside / "session.json", document);
    EXPECT_EQ(verify_failure(), "");
}

TEST_F(Open, AFlippedByteInAnyFrameIsNamedByVerify) {
    for (const char* name :
         {"data/frames/0000_lamp-0.tif", "data/frames/0002_lamp-2.tif", "data/masks/mask.png", "data/rig.toml"}) {
        const std::string good = read_file(folder / name);
        std::string bad = good;
        bad[good.size() - 1] ^= 0x10;
        write_file(folder / name, bad);
        EXPECT_THAT(verify_failure(), AllOf(HasSubstr(name), HasSubstr("1 bad file in all")));
        write_file(folder / name, good);
    }
    EXPECT_EQ(verify_failure(), "");
}

TEST_F(Open, VerifyCountsMissingChangedAndForeignFiles) {
    fs::remove(folder / "data/frames/0000_lamp-0.tif");
    EXPECT_THAT(verify_failure(), AllOf(HasSubstr("frames/0000_lamp-0.tif is missing"), HasSubstr("1 bad file in")));
    write_file(folder / "data/frames/0001_lamp-1.tif", "");
    write_file(folder / "data/frames/foreign.tif", "x");
    fs::create_symlink("/etc/passwd", folder / "data/masks/passwd");
    EXPECT_THAT(verify_failure(), AllOf(HasSubstr("frames/0000_lamp-0.tif"), HasSubstr("4 bad files in all")));
    fs::remove(folder / "data/masks/passwd");
    written_session(temporary.path() / "other", 3).seal();
    for (const char* name : {"0000_lamp-0.tif", "0001_lamp-1.tif"})
        fs::copy_file(temporary.path() / "other/data/frames" / name, folder / "data/frames" / name,
                      fs::copy_options::overwrite_existing);
    EXPECT_THAT(verify_failure(), AllOf(HasSubstr("data/frames/foreign.tif is not in the manifest")));
}

TEST_F(Open, DerivedFilesBesideThePayloadAreNoFault) {
    fs::create_directories(folder / "results");
    write_file(folder / "results/normals.exr", "x");
    write_file(folder / "report.html", "x");
    EXPECT_EQ(verify_failure(), "");
}

TEST_F(Open, AnyChangedByteOfTheDescriptionIsFound) {
    for (const char* name :
         {"data/session.json", "manifest-sha256.txt", "tagmanifest-sha256.txt", "bagit.txt", "bag-info.txt"}) {
        const std::string good = read_file(folder / name);
        for (std::size_t at = 0; at < good.size(); ++at) {
            std::string bad = good;
            bad[at] ^= 0x01;
            write_file(folder / name, bad);
            const std::string failure = failure_of<InputError>([this] { Session::open(folder).verify(); });
            ASSERT_NE(failure, "") << name << " byte " << at;
        }
        write_file(folder / name, good);
    }
    EXPECT_EQ(verify_failure(), "");
}

TEST(Sha256, KnownAnswers) {  // FIPS 180-4 examples
    EXPECT_EQ(sha256_hex({}), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    EXPECT_EQ(sha256_hex(bytes_of("abc")), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    const TemporaryFolder temporary;
    write_file(temporary.path() / "million", std::string(1'000'000, 'a'));
    EXPECT_EQ(sha256_of_file(temporary.path() / "million"),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

}  // namespace
}  // namespace darkbox
