#pragma once

#include <set>
#include <string>

namespace darkbox {

/// The known word that is the fewest insertions, deletions and replacements of one character away from `word`; empty
/// when there are no known words. The first in alphabetical order wins a tie.
std::string nearest_word(const std::string& word, const std::set<std::string>& known);

}  // namespace darkbox
