#pragma once

#include <map>
#include <utility>
#include <vector>

namespace darkbox::test {

/// Adjusted Rand index of two labellings of the same things: 1 = the same parts, 0 = as alike as by chance (Hubert and
/// Arabie 1985).
inline double adjusted_rand_index(const std::vector<int>& a, const std::vector<int>& b) {
    std::map<std::pair<int, int>, double> both;
    std::map<int, double> in_a;
    std::map<int, double> in_b;
    for (std::size_t i = 0; i < a.size(); ++i) {
        ++both[{a[i], b[i]}];
        ++in_a[a[i]];
        ++in_b[b[i]];
    }
    const auto pairs = [](const auto& counts) {
        double sum = 0;
        for (const auto& [label, n] : counts) sum += n * (n - 1) / 2;
        return sum;
    };
    const auto n = static_cast<double>(a.size());
    const double by_chance = pairs(in_a) * pairs(in_b) / (n * (n - 1) / 2);
    return (pairs(both) - by_chance) / ((pairs(in_a) + pairs(in_b)) / 2 - by_chance);
}

}  // namespace darkbox::test
