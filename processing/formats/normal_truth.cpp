#include <fmt/format.h>
#include <matio.h>

#include <cmath>
#include <memory>

#include "processing/formats/bytes.h"
#include "processing/formats/map_files.h"

namespace darkbox {
namespace {

constexpr const char* key = "Normal_gt";

using MatFile = std::unique_ptr<mat_t, int (*)(mat_t*)>;
using MatVariable = std::unique_ptr<matvar_t, void (*)(matvar_t*)>;

MatVariable require_normals(mat_t* file, const std::string& name) {
    MatVariable variable(Mat_VarRead(file, key), Mat_VarFree);
    if (!variable) throw bad_picture(name, fmt::format("has no variable {}", key));
    if (variable->rank != 3 || variable->dims[2] != 3 || variable->class_type != MAT_C_DOUBLE || variable->isComplex ||
        variable->data == nullptr)
        throw bad_picture(name, fmt::format("has a {} that is not rows x columns x 3 of doubles", key));
    return variable;
}

}  // namespace

NormalMap read_normal_truth(const std::filesystem::path& path) {
    const std::string name = path.string();
    const MatFile file(Mat_Open(name.c_str(), MAT_ACC_RDONLY), Mat_Close);
    if (!file) throw bad_picture(name, "is missing, or is not a MATLAB file");
    const MatVariable variable = require_normals(file.get(), name);
    const auto rows = static_cast<int>(variable->dims[0]), cols = static_cast<int>(variable->dims[1]);
    const auto* values = static_cast<const double*>(variable->data);  // column by column, then plane by plane
    const std::size_t plane = variable->dims[0] * variable->dims[1];
    NormalMap map{cv::Mat3f(rows, cols, cv::Vec3f(0, 0, 0)), cv::Mat1b(rows, cols, uchar{0})};
    for (int x = 0; x < cols; ++x)
        for (int y = 0; y < rows; ++y) {
            const double* at = values + static_cast<std::size_t>(x) * variable->dims[0] + static_cast<std::size_t>(y);
            const cv::Vec3d n(at[0], at[plane], at[2 * plane]);
            const double length = cv::norm(n);
            if (!(length > 0.5)) continue;
            map.normal(y, x) = n / length;
            map.valid(y, x) = 255;
        }
    return map;
}

}  // namespace darkbox
