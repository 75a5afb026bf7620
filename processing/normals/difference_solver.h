#pragma once

#include <Eigen/SparseCholesky>
#include <vector>

#include "processing/normals/aggregates.h"
#include "processing/normals/pixel_grid.h"

namespace darkbox {

/// Solves for heights from weighted differences: the normal equations of sum of w (z_b - z_a - rise)^2 are A z = b with
/// A the weights' graph Laplacian. Conjugate gradients behind a multigrid K-cycle over patches; single precision, so a
/// caller refines. Every connected part is solved up to a constant. Bit-identical on any number of threads.
/// Thread-hostile only in that one object serves one solve at a time.
class DifferenceSolver {
public:
    DifferenceSolver(const PixelGrid& grid, const DifferenceWeights& weights);

    /// z with A z = `residual` nearly: stops when the error's energy norm has fallen to `tolerance` of its start, or
    /// after `most_iterations`. `residual` is indexed as the grid.
    std::vector<float> solve(std::vector<float> residual, double tolerance, int most_iterations);

    int iterations() const { return iterations_; }  ///< of all solves so far

private:
    /// A coarse level with what its K-cycle needs: right side, result, two directions and their images.
    struct Level {
        CoarseGraph graph;
        std::vector<int> patch;  ///< to the next coarser level
        std::vector<float> right, result, first, first_image, second, second_image, rest;
    };

    void smooth_and_correct(const std::vector<float>& residual, std::vector<float>& z);
    void cycle(std::size_t level, const std::vector<float>& residual, std::vector<float>& z);
    void solve_level(std::size_t level);
    void solve_coarsest();
    void factorise_coarsest();

    const PixelGrid& grid_;
    const DifferenceWeights& weights_;
    std::vector<int> patch_;
    std::vector<float> inverse_diagonal_, rest_;
    std::vector<Level> levels_;
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> coarsest_;
    int iterations_ = 0;
};

}  // namespace darkbox
