#include "processing/normals/difference_solver.h"

#include <algorithm>
#include <cmath>

namespace darkbox {
namespace {

constexpr float damping = 0.6F;             // of Jacobi's step
constexpr std::size_t coarse_enough = 500;  // nodes that are solved directly
constexpr double worthwhile = 0.8;          // a level with a greater share of the finer one's nodes stops the descent
constexpr double anchor = 1e-3;             // of a node's diagonal: a part's own height has no equation
constexpr double enough_after_first = 0.0625;  // squared; a K-cycle's second direction is left out below

using Floats = std::vector<float>;

double dot(const Floats& a, const Floats& b, std::size_t begin, std::size_t end) {
    return sum_of_blocks(begin, end, [&](std::size_t first, std::size_t last) {
        double sum = 0;
        for (std::size_t i = first; i < last; ++i) sum += static_cast<double>(a[i]) * static_cast<double>(b[i]);
        return sum;
    });
}
double dot(const Floats& a, const Floats& b) { return dot(a, b, 0, a.size()); }

/// out = A x on the picture's grid.
void multiply(const PixelGrid& grid, const DifferenceWeights& w, const Floats& x, Floats& out) {
    const std::size_t s = grid.stride();
    for_blocks(grid.begin(), grid.end(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i)
            out[i] = w.right[i] * (x[i] - x[i + 1]) + w.right[i - 1] * (x[i] - x[i - 1]) +
                     w.down[i] * (x[i] - x[i + s]) + w.down[i - s] * (x[i] - x[i - s]);
    });
}

void multiply(const CoarseGraph& graph, const Floats& x, Floats& out) {
    for_blocks(0, graph.nodes(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            float sum = 0;
            for (int e = graph.start[i]; e < graph.start[i + 1]; ++e)
                sum += graph.weight[e] * (x[i] - x[graph.neighbour[e]]);
            out[i] = sum;
        }
    });
}

void jacobi_start(const Floats& inverse_diagonal, const Floats& residual, Floats& z) {
    for_blocks(0, z.size(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) z[i] = damping * inverse_diagonal[i] * residual[i];
    });
}

/// z += damping D^-1 (residual - image).
void jacobi_step(const Floats& inverse_diagonal, const Floats& residual, const Floats& image, Floats& z) {
    for_blocks(0, z.size(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) z[i] += damping * inverse_diagonal[i] * (residual[i] - image[i]);
    });
}

/// What is left of the residual, summed over each patch.
void restrict_rest(const std::vector<int>& patch, const Floats& residual, const Floats& image, Floats& coarse) {
    std::fill(coarse.begin(), coarse.end(), 0.0F);
    for (std::size_t i = 0; i < patch.size(); ++i)
        if (patch[i] >= 0) coarse[static_cast<std::size_t>(patch[i])] += residual[i] - image[i];
}

void add_coarse(const std::vector<int>& patch, const Floats& coarse, Floats& z) {
    for_blocks(0, z.size(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i)
            if (patch[i] >= 0) z[i] += coarse[static_cast<std::size_t>(patch[i])];
    });
}

Floats inverse_diagonal_of(const PixelGrid& grid, const DifferenceWeights& w) {
    Floats inverse(grid.size(), 0.0F);
    for_blocks(grid.begin(), grid.end(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            const float sum = w.right[i] + w.right[i - 1] + w.down[i] + w.down[i - grid.stride()];
            inverse[i] = sum > 0 ? 1.0F / sum : 0.0F;
        }
    });
    return inverse;
}

}  // namespace

DifferenceSolver::DifferenceSolver(const PixelGrid& grid, const DifferenceWeights& weights)
    : grid_(grid), weights_(weights), inverse_diagonal_(inverse_diagonal_of(grid, weights)), rest_(grid.size(), 0.0F) {
    Aggregation aggregation = aggregate(grid, weights);
    patch_ = std::move(aggregation.patch);
    for (;;) {
        const std::size_t nodes = aggregation.graph.nodes();
        Level level;
        level.graph = std::move(aggregation.graph);
        for (Floats* vector : {&level.right, &level.result, &level.first, &level.first_image, &level.second,
                               &level.second_image, &level.rest})
            vector->assign(nodes, 0.0F);
        levels_.push_back(std::move(level));
        if (nodes <= coarse_enough) break;
        aggregation = aggregate(levels_.back().graph);
        if (static_cast<double>(aggregation.graph.nodes()) > worthwhile * static_cast<double>(nodes)) break;
        levels_.back().patch = std::move(aggregation.patch);
    }
    factorise_coarsest();
}

void DifferenceSolver::factorise_coarsest() {
    const CoarseGraph& graph = levels_.back().graph;
    const auto nodes = static_cast<int>(graph.nodes());
    std::vector<Eigen::Triplet<double>> terms;
    for (int i = 0; i < nodes; ++i) {
        double diagonal = 0;
        for (int e = graph.start[i]; e < graph.start[i + 1]; ++e) {
            diagonal += graph.weight[e];
            if (graph.neighbour[e] < i) terms.emplace_back(i, graph.neighbour[e], -graph.weight[e]);
        }
        terms.emplace_back(i, i, diagonal > 0 ? diagonal * (1 + anchor) : 1.0);
    }
    Eigen::SparseMatrix<double> matrix(nodes, nodes);
    matrix.setFromTriplets(terms.begin(), terms.end());
    coarsest_.compute(matrix);
}

void DifferenceSolver::solve_coarsest() {
    Level& level = levels_.back();
    Eigen::VectorXd right(static_cast<Eigen::Index>(level.right.size()));
    for (std::size_t i = 0; i < level.right.size(); ++i) right[static_cast<Eigen::Index>(i)] = level.right[i];
    const Eigen::VectorXd result = coarsest_.solve(right);
    for (std::size_t i = 0; i < level.result.size(); ++i)
        level.result[i] = static_cast<float>(result[static_cast<Eigen::Index>(i)]);
}

void DifferenceSolver::cycle(std::size_t at, const Floats& residual, Floats& z) {
    Level& level = levels_[at];
    jacobi_start(level.graph.inverse_diagonal, residual, z);
    multiply(level.graph, z, level.rest);
    restrict_rest(level.patch, residual, level.rest, levels_[at + 1].right);
    solve_level(at + 1);
    add_coarse(level.patch, levels_[at + 1].result, z);
    multiply(level.graph, z, level.rest);
    jacobi_step(level.graph.inverse_diagonal, residual, level.rest, z);
}

/// Two steps of conjugate gradients behind the next level's cycle (Notay 2010, algorithm 3.2).
void DifferenceSolver::solve_level(std::size_t at) {
    if (at + 1 == levels_.size()) return solve_coarsest();
    Level& level = levels_[at];
    cycle(at, level.right, level.first);
    multiply(level.graph, level.first, level.first_image);
    const double energy = dot(level.first, level.first_image), gain = dot(level.first, level.right);
    const double before = dot(level.right, level.right);
    const double step = energy > 0 ? gain / energy : 0;
    for (std::size_t i = 0; i < level.right.size(); ++i) {
        level.result[i] = static_cast<float>(step) * level.first[i];
        level.right[i] -= static_cast<float>(step) * level.first_image[i];
    }
    if (energy <= 0 || dot(level.right, level.right) <= enough_after_first * before) return;
    cycle(at, level.right, level.second);
    multiply(level.graph, level.second, level.second_image);
    const double mixed = dot(level.second, level.first_image);
    const double own = dot(level.second, level.second_image) - mixed * mixed / energy;
    if (own <= 0) return;
    const double second_step = dot(level.second, level.right) / own;
    const double back = mixed * second_step / energy;
    for (std::size_t i = 0; i < level.right.size(); ++i)
        level.result[i] +=
            static_cast<float>(second_step) * level.second[i] - static_cast<float>(back) * level.first[i];
}

void DifferenceSolver::smooth_and_correct(const Floats& residual, Floats& z) {
    jacobi_start(inverse_diagonal_, residual, z);
    multiply(grid_, weights_, z, rest_);
    restrict_rest(patch_, residual, rest_, levels_.front().right);
    solve_level(0);
    add_coarse(patch_, levels_.front().result, z);
    multiply(grid_, weights_, z, rest_);
    jacobi_step(inverse_diagonal_, residual, rest_, z);
}

Floats DifferenceSolver::solve(Floats residual, double tolerance, int most_iterations) {
    Floats z(grid_.size(), 0.0F), fresh(grid_.size(), 0.0F), direction(grid_.size(), 0.0F), image(grid_.size(), 0.0F);
    double energy = 0, start = 0;
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
        smooth_and_correct(residual, fresh);
        const double size = dot(fresh, residual);
        if (iteration == 0) start = size;
        if (!(size > tolerance * tolerance * start)) break;
        ++iterations_;
        // The K-cycle is not linear, so a new direction is made conjugate to the last one by its image.
        const double overlap = energy > 0 ? dot(fresh, image) / energy : 0;
        for_blocks(0, direction.size(), [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i)
                direction[i] = fresh[i] - static_cast<float>(overlap) * direction[i];
        });
        multiply(grid_, weights_, direction, image);
        energy = dot(direction, image);
        if (!(energy > 0)) break;
        const auto step = static_cast<float>(dot(direction, residual) / energy);
        for_blocks(0, z.size(), [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                z[i] += step * direction[i];
                residual[i] -= step * image[i];
            }
        });
    }
    return z;
}

}  // namespace darkbox
