#pragma once

#include <opencv2/core.hpp>
#include <span>

namespace darkbox {

/// Points that are written out when they are asked for, so that long vectors which repeat one another, such as the
/// neighbourhoods of a picture, need not all lie in memory. Const calls are thread-safe.
class PointSource {
public:
    PointSource() = default;
    PointSource(const PointSource&) = delete;
    PointSource& operator=(const PointSource&) = delete;
    virtual ~PointSource() = default;

    virtual int count() const = 0;
    virtual int dimensions() const = 0;
    /// Coordinates of points[i], finite, at to + i * dimensions().
    virtual void read(std::span<const int> points, float* to) const = 0;
};

/// One point in each row of a matrix, which must outlive this.
class MatrixPoints : public PointSource {
public:
    explicit MatrixPoints(const cv::Mat1f& rows) : rows_(rows) {}

    int count() const override { return rows_.rows; }
    int dimensions() const override { return rows_.cols; }
    void read(std::span<const int> points, float* to) const override {
        for (const int point : points) to = std::copy_n(rows_[point], rows_.cols, to);
    }

private:
    const cv::Mat1f& rows_;
};

}  // namespace darkbox
