#include "processing/formats/ply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <sstream>

#include "acquisition/frame/error.h"
#include "processing/formats/atomic_file.h"
#include "tests/support/child_process.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using test::input_error_of;
using testing::HasSubstr;

/// A reader after the format's description (Turk 1994, "The PLY polygon file format"), for what darkbox writes.
struct Mesh {
    struct Vertex {
        float position[3], normal[3];
        unsigned char colour[3];
    };
    std::string comment;
    std::vector<Vertex> vertices;
    std::vector<std::array<int, 3>> faces;
    std::size_t rest = 0;  ///< bytes that nobody declared
};

Mesh read_ply(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::string line;
    Mesh mesh;
    std::size_t vertices = 0, faces = 0;
    std::vector<std::string> properties;
    while (std::getline(in, line) && line != "end_header") {
        std::istringstream words(line);
        std::string word, name;
        words >> word;
        if (word == "comment") mesh.comment = line;
        if (word == "property") properties.push_back(line.substr(9));
        if (word == "element") words >> name >> (name == "vertex" ? vertices : faces);
    }
    EXPECT_THAT(properties,
                testing::ElementsAre("float x", "float y", "float z", "float nx", "float ny", "float nz", "uchar red",
                                     "uchar green", "uchar blue", "list uchar int vertex_indices"));
    for (std::size_t i = 0; i < vertices; ++i) {
        Mesh::Vertex vertex{};
        in.read(reinterpret_cast<char*>(vertex.position), 12);
        in.read(reinterpret_cast<char*>(vertex.normal), 12);
        in.read(reinterpret_cast<char*>(vertex.colour), 3);
        mesh.vertices.push_back(vertex);
    }
    for (std::size_t i = 0; i < faces; ++i) {
        EXPECT_EQ(in.get(), 3);
        std::array<int, 3> face{};
        in.read(reinterpret_cast<char*>(face.data()), 12);
        mesh.faces.push_back(face);
    }
    EXPECT_TRUE(in);
    std::ostringstream rest;
    rest << in.rdbuf();
    mesh.rest = rest.str().size();
    return mesh;
}

struct Given {
    HeightMap surface;
    NormalMap normals;
    AlbedoMap albedo;
};

Given bowl(int width, int height) {
    Given given;
    given.surface.height = cv::Mat1f(height, width);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) given.surface.height(y, x) = static_cast<float>(x + 10 * y);
    given.surface.valid = cv::Mat1b(height, width, uchar{255});
    given.surface.cut = cv::Mat1b(height, width, uchar{0});
    given.normals = {cv::Mat3f(height, width, cv::Vec3f(0, 0.6F, 0.8F)), given.surface.valid};
    given.albedo = {cv::Mat3f(height, width, cv::Vec3f(1, 0, 0)), given.surface.valid};
    return given;
}

class Ply : public testing::Test {
protected:
    Mesh written(const Given& given, const std::optional<ViewGeometry>& view = {}) {
        counts_ = write_ply(path(), given.surface, given.normals, given.albedo, view);
        return read_ply(path());
    }
    std::filesystem::path path() const { return folder_.path() / "s.ply"; }
    test::TemporaryFolder folder_;
    MeshCounts counts_;
};

TEST_F(Ply, HasAVertexForEveryPixelAndTwoTrianglesForEverySquare) {
    Given given = bowl(3, 3);
    given.surface.valid(0, 0) = 0;
    const Mesh mesh = written(given);
    EXPECT_THAT(mesh.comment, HasSubstr("units: pixels"));
    ASSERT_EQ(mesh.vertices.size(), 8u);
    EXPECT_EQ(counts_.vertices, 8u);
    EXPECT_EQ(mesh.faces.size(), 6u);
    EXPECT_EQ(mesh.rest, 0u);
    EXPECT_THAT(mesh.vertices[0].position, testing::ElementsAre(0, 1, 1)) << "the middle of the top row; y is up";
    EXPECT_THAT(mesh.vertices[7].position, testing::ElementsAre(1, -1, 22));
    EXPECT_THAT(mesh.vertices[0].normal, testing::ElementsAre(0, 0.6F, 0.8F));
    EXPECT_THAT(mesh.vertices[0].colour, testing::ElementsAre(255, 0, 0));
}

TEST_F(Ply, TrianglesFaceTheCamera) {
    Given given = bowl(4, 3);
    given.surface.height.setTo(0);
    const Mesh mesh = written(given);
    for (const auto& face : mesh.faces) {
        const auto* a = mesh.vertices[static_cast<std::size_t>(face[0])].position;
        const auto* b = mesh.vertices[static_cast<std::size_t>(face[1])].position;
        const auto* c = mesh.vertices[static_cast<std::size_t>(face[2])].position;
        EXPECT_GT((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]), 0);
    }
}

TEST_F(Ply, NoTriangleBridgesADepthEdge) {
    Given given = bowl(4, 4);
    for (int y = 0; y < 4; ++y) given.surface.cut(y, 1) = cut_right;
    EXPECT_EQ(written(given).faces.size(), 12u) << "the middle column of squares is missing";
    given.surface.cut.setTo(0);
    given.surface.cut(1, 2) = cut_down;
    EXPECT_EQ(written(given).faces.size(), 14u) << "the squares left and right of the edge are missing";
    EXPECT_EQ(counts_.faces, 14u);
}

TEST_F(Ply, MillimetresGoThroughTheView) {
    const ViewGeometry view{0.25, {1.5, 1}, 400};
    const Given given = bowl(4, 3);
    const Mesh mesh = written(given, view);
    EXPECT_THAT(mesh.comment, HasSubstr("millimetres (0.25 per pixel at z = 0)"));
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 4; ++x) {
            const Eigen::Vector3d expected = view.point_at(cv::Point2d(x, y), x + 10 * y);
            for (int i = 0; i < 3; ++i)
                EXPECT_NEAR(mesh.vertices[static_cast<std::size_t>(4 * y + x)].position[i], expected[i], 1e-5);
        }
}

TEST_F(Ply, AnotherProgramReadsTheSame) {
    if (!std::filesystem::exists("/usr/bin/assimp")) GTEST_SKIP() << "install assimp-utils";
    written(bowl(20, 10));
    test::ChildProcess assimp({"/usr/bin/assimp", "info", path().string()}, folder_.path() / "assimp");
    EXPECT_EQ(assimp.wait(), 0) << assimp.err();
    EXPECT_THAT(assimp.out(), testing::ContainsRegex("Faces: +342"));
    EXPECT_THAT(assimp.out(), testing::ContainsRegex("Vertices: +200"));
}

TEST_F(Ply, WhatCannotBeWrittenIsSaid) {
    Given given = bowl(3, 3);
    EXPECT_THAT(input_error_of([&] { write_ply("/proc/none/s.ply", given.surface, given.normals, given.albedo); }),
                HasSubstr("/proc/none"));
    given.albedo.albedo = cv::Mat3f(2, 2);
    EXPECT_THAT(input_error_of([&] { written(given); }), HasSubstr("albedo map is 2x2"));
    given = bowl(3, 3);
    given.surface.valid.setTo(0);
    EXPECT_THAT(input_error_of([&] { written(given); }), HasSubstr("no points"));
    EXPECT_FALSE(std::filesystem::exists(path()));
}

}  // namespace
}  // namespace darkbox
