#include "processing/relight/relighter.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"
#include "processing/maps/require.h"
#include "processing/relight/scene_checks.h"
#include "processing/relight/shade_block.h"

namespace darkbox {
namespace {

constexpr float smallest_mean_albedo = 1e-6F;  ///< a ratio to less than this means nothing

cv::Vec4f table_entry(const cv::Vec3f& c) { return {c[0], c[1], c[2], 0.0F}; }

/// [label][level], label 0 black.
std::vector<cv::Vec4f> shading_table(const ShadingMaps& maps) {
    std::vector<cv::Vec4f> table(maps.levels, cv::Vec4f(0, 0, 0, 0));
    for (int k = 0; k < maps.texels; ++k)
        std::transform(maps.radiance[k], maps.radiance[k] + maps.levels, std::back_inserter(table), table_entry);
    return table;
}

/// The scene's own pixels, a block at a time.
class ScenePixels {
public:
    explicit ScenePixels(const RelightScene& scene)
        : scene_(scene), per_albedo_(scene.index.texels + 1, cv::Vec3f(0, 0, 0)) {
        for (int k = 0; k < scene.index.texels; ++k)
            for (int c = 0; c < 3; ++c)
                if (const float mean = scene.shading.mean_albedo(k, 0)[c]; mean > smallest_mean_albedo)
                    per_albedo_[k + 1][c] = 1 / mean;
    }

    bool rendered(int y, int x) const { return scene_.index.label(y, x) != 0 && scene_.normals.valid(y, x) != 0; }

    PixelBlock block(int y, int first) const {
        PixelBlock block;
        const int count = std::min(block_pixels, scene_.index.label.cols - first);
        for (int i = 0; i < block_pixels; ++i)
            if (i < count && rendered(y, first + i))
                put(y, first + i, i, block);
            else
                put_black(i, block);
        return block;
    }

private:
    void put(int y, int x, int i, PixelBlock& block) const {
        const int label = scene_.index.label(y, x);
        const cv::Vec3f& normal = scene_.normals.normal(y, x);
        const float length = std::sqrt(normal.dot(normal));
        block.texel[i] = label;
        for (int c = 0; c < 3; ++c) {
            block.normal[c][i] = normal[c] / length;
            block.detail[c][i] = detail(y, x, label, c);
        }
    }

    static void put_black(int i, PixelBlock& block) {
        block.texel[i] = 0;
        for (int c = 0; c < 3; ++c) block.normal[c][i] = block.detail[c][i] = 0;
        block.normal[2][i] = 1;
    }

    /// 1 where there is nothing to compare, 0 for an albedo that is negative or not a number.
    float detail(int y, int x, int label, int channel) const {
        const float per_albedo = per_albedo_[label][channel];
        if (scene_.albedo.valid(y, x) == 0 || per_albedo == 0) return 1;
        return std::max(0.0F, per_albedo * scene_.albedo.albedo(y, x)[channel]);
    }

    const RelightScene& scene_;
    std::vector<cv::Vec3f> per_albedo_;  ///< of each label; 0 = it has none
};

/// The blocks that have a pixel to render, row by row.
struct CompactRows {
    struct Block {
        int first_column;
        CompactBlock pixels;
    };
    std::vector<std::vector<Block>> rows;
};

CompactRows compact_rows(const ScenePixels& pixels, cv::Size size) {
    CompactRows result;
    result.rows.resize(static_cast<std::size_t>(size.height));
    tbb::parallel_for(0, size.height, [&](int y) {
        int x = 0;
        const auto next_rendered = [&] {
            while (x < size.width && !pixels.rendered(y, x)) ++x;
            return x < size.width;
        };
        for (; next_rendered(); x += block_pixels)
            result.rows[static_cast<std::size_t>(y)].push_back({x, compacted(pixels.block(y, x))});
    });
    return result;
}

FrameLight frame_light(const Light& light) {
    FrameLight result{{cv::Vec3d(light.direction[0], light.direction[1], light.direction[2]),
                       cv::Vec3d(light.intensity[0], light.intensity[1], light.intensity[2])},
                      {}};
    if (light.near) result.near.emplace(*light.near);
    return result;
}

std::vector<FrameLight> used_lights(const Lights& lights, const SceneGeometry& geometry) {
    require_lights(lights);
    std::vector<FrameLight> used;
    for (const Light& light : lights) {
        if (!light.used) continue;
        if (light.near) require_near_lamp(light, geometry);
        used.push_back(frame_light(light));
    }
    return used;
}

void require_same_texels(const FoldedEnvironment& environment, int texels) {
    if (environment.texels() != texels)
        throw InputError(fmt::format("the environment was folded for {} texels, but the object has {}",
                                     environment.texels(), texels),
                         "fold it for this object");
}

/// Puts blocks one after the other into a row and black between them.
template <class Channel>
class RowWriter {
public:
    RowWriter(Channel* row, int columns) : row_(row), columns_(columns) {}

    /// `shade` writes 3 x 64 channels.
    template <class Shade>
    void put(int first_column, Shade&& shade) {
        black_until(first_column);
        const int count = std::min(block_pixels, columns_ - first_column);
        if (count == block_pixels) {
            shade(row_ + 3 * first_column);
        } else {
            alignas(64) Channel whole[3 * block_pixels];
            shade(whole);
            std::copy_n(whole, 3 * count, row_ + 3 * first_column);
        }
        done_ = first_column + count;
    }

    void black_until(int column) { std::fill(row_ + 3 * done_, row_ + 3 * column, Channel{0}); }

private:
    Channel* row_;
    int columns_;
    int done_ = 0;
};

}  // namespace

struct Relighter::Prepared {
    explicit Prepared(const RelightScene& of)
        : scene(of), table(shading_table(of.shading)), pixels(scene), compact(compact_rows(pixels, size())) {}

    cv::Size size() const { return scene.index.label.size(); }

    Frame frame(const RelightOptions& options) const {
        options.validate();
        return {.shading = table.data(), .levels = scene.shading.levels, .options = options};
    }
    Frame frame(const Lights& lights, const RelightOptions& options) const {
        Frame result = frame(options);
        result.lights = used_lights(lights, scene.geometry);
        result.near = std::any_of(result.lights.begin(), result.lights.end(),
                                  [](const FrameLight& light) { return light.near.has_value(); });
        return result;
    }
    Frame frame(const FoldedEnvironment& environment, const RelightOptions& options) const {
        require_same_texels(environment, scene.index.texels);
        Frame result = frame(options);
        result.environment = &environment;
        return result;
    }
    Frame frame(ConstantCoefficient coefficient, const RelightOptions& options) const {
        require_range("the coefficient r", coefficient.r, 0, 1);
        Frame result = frame(options);
        result.constant_r = static_cast<float>(coefficient.r);
        return result;
    }

    const PointBlock* points_of(const Frame& frame, int row, int first_column, PointBlock& storage) const {
        if (!frame.near) return nullptr;
        find_points(scene.geometry, row, first_column, storage);
        return &storage;
    }

    void render(const Frame& frame, cv::Mat3f& into, const WorkContext& work) const {
        require_size("the buffer to render into", into.size(), size());
        on_threads_of(work, [&] {
            tbb::parallel_for(0, into.rows, [&](int y) {
                RowWriter<float> row(into.ptr<float>(y), into.cols);
                for (int x = 0; x < into.cols; x += block_pixels)
                    row.put(x, [&](float* rgb) {
                        PointBlock storage;
                        const PointBlock* points = points_of(frame, y, x, storage);
                        shade_to_floats(frame, pixels.block(y, x), points, rgb);
                    });
            });
        });
    }

    void render(const Frame& frame, Encoding encoding, cv::Mat3b& into, const WorkContext& work) const {
        require_size("the buffer to render into", into.size(), size());
        on_threads_of(work, [&] {
            tbb::parallel_for(0, into.rows, [&](int y) {
                RowWriter<std::uint8_t> row(into.ptr<std::uint8_t>(y), into.cols);
                for (const CompactRows::Block& block : compact.rows[static_cast<std::size_t>(y)])
                    row.put(block.first_column, [&](std::uint8_t* rgb) {
                        PointBlock storage;
                        const PointBlock* points = points_of(frame, y, block.first_column, storage);
                        shade_to_bytes(frame, block.pixels, points, encoding, rgb);
                    });
                row.black_until(into.cols);
            });
        });
    }

    RelightScene scene;
    std::vector<cv::Vec4f> table;
    ScenePixels pixels;
    CompactRows compact;
};

Relighter::Relighter(const RelightScene& scene, const WorkContext& work) {
    require_scene(scene);
    prepared_ = on_threads_of(work, [&] { return std::make_unique<const Prepared>(scene); });
}

Relighter::Relighter(Relighter&&) noexcept = default;
Relighter& Relighter::operator=(Relighter&&) noexcept = default;
Relighter::~Relighter() = default;

cv::Size Relighter::size() const { return prepared_->size(); }

FoldedEnvironment Relighter::fold(const Environment& environment, const RelightOptions& options,
                                  const WorkContext& work) const {
    options.validate();
    require_probe(environment);
    return on_threads_of(work, [&] {
        return FoldedEnvironment(probe_lights(environment, options.environment_yaw), prepared_->scene.shading, options);
    });
}

void Relighter::render(const Lights& lights, const RelightOptions& options, cv::Mat3f& into,
                       const WorkContext& work) const {
    prepared_->render(prepared_->frame(lights, options), into, work);
}

void Relighter::render(const Lights& lights, const RelightOptions& options, Encoding encoding, cv::Mat3b& into,
                       const WorkContext& work) const {
    prepared_->render(prepared_->frame(lights, options), encoding, into, work);
}

void Relighter::render(const FoldedEnvironment& environment, const RelightOptions& options, cv::Mat3f& into,
                       const WorkContext& work) const {
    prepared_->render(prepared_->frame(environment, options), into, work);
}

void Relighter::render(const FoldedEnvironment& environment, const RelightOptions& options, Encoding encoding,
                       cv::Mat3b& into, const WorkContext& work) const {
    prepared_->render(prepared_->frame(environment, options), encoding, into, work);
}

void Relighter::render(ConstantCoefficient coefficient, const RelightOptions& options, cv::Mat3f& into,
                       const WorkContext& work) const {
    prepared_->render(prepared_->frame(coefficient, options), into, work);
}

void Relighter::render(ConstantCoefficient coefficient, const RelightOptions& options, Encoding encoding,
                       cv::Mat3b& into, const WorkContext& work) const {
    prepared_->render(prepared_->frame(coefficient, options), encoding, into, work);
}

}  // namespace darkbox
