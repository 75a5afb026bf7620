#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>

namespace darkbox {

/// Points split at places that depend on their number alone, so that sums come out the same on any number of threads.
class Blocks {
public:
    /// At most `most` blocks.
    Blocks(int points, int most)
        : points_(points),
          size_(std::max(smallest, (points + most - 1) / most)),
          count_((points + size_ - 1) / size_) {}

    int count() const { return count_; }
    int begin(int block) const { return block * size_; }
    int end(int block) const { return std::min(points_, begin(block) + size_); }

    template <class Body>
    void for_each(const Body& body) const {
        tbb::parallel_for(0, count_, body);
    }

private:
    static constexpr int smallest = 512;

    int points_;
    int size_;
    int count_;
};

}  // namespace darkbox
