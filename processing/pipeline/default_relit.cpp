#include "processing/pipeline/default_relit.h"

#include "processing/maps/srgb.h"
#include "processing/pipeline/steps.h"
#include "processing/relight/relighter.h"

namespace darkbox {
namespace {

struct Setting {
    const char* name;
    const char* caption;
    Lights lights;
    ReflectanceModel model = ReflectanceModel::lambert;
};

Light toward(double x, double y, double z, const Eigen::Vector3d& colour = {1, 1, 1}) {
    Light light;
    light.direction = Eigen::Vector3d(x, y, z).normalized();
    light.intensity = colour;
    return light;
}

std::vector<Setting> settings() {
    return {{"left", "One light from the left (-1, 0, 1)", {toward(-1, 0, 1)}},
            {"right", "One light from the right (1, 0, 1)", {toward(1, 0, 1)}},
            {"above", "One light from above (0, 1, 1)", {toward(0, 1, 1)}},
            {"below", "One light from below (0, -1, 1)", {toward(0, -1, 1)}},
            {"phong", "One light from the upper left, Phong", {toward(-0.5, 0.5, 1)}, ReflectanceModel::phong},
            {"two-lights",
             "A warm light from the left and a cool one from the right",
             {toward(-1, 0.3, 0.7, {1.0, 0.6, 0.3}), toward(1, 0.3, 0.7, {0.3, 0.6, 1.0})}}};
}

}  // namespace

std::vector<RelitPicture> relight_by_default(const RelightScene& scene, const WorkContext& work) {
    const double gain = viewing_gain(scene.albedo.albedo, scene.albedo.valid, 99.0);
    const Relighter relighter(scene, work);
    const std::vector<Setting> all = settings();
    std::vector<RelitPicture> pictures;
    for (const Setting& setting : all) {
        step(work, {"relighting", pictures.size(), all.size(), setting.name});
        RelightOptions options;
        options.model = setting.model;
        options.exposure = gain;
        cv::Mat3b image(relighter.size());
        relighter.render(setting.lights, options, Encoding::srgb, image, work);
        pictures.push_back({setting.name, setting.caption, image});
    }
    return pictures;
}

}  // namespace darkbox
