#pragma once

#include <array>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace darkbox {

/// The fifteen elements of Dublin Core (ISO 15836-1), in the order of the alphabet.
inline constexpr std::array<std::string_view, 15> dublin_core_elements{
    "contributor", "coverage", "creator", "date",   "description", "format", "identifier", "language",
    "publisher",   "relation", "rights",  "source", "subject",     "title",  "type"};

/// By element; each may have several values.
using DublinCore = std::map<std::string, std::vector<std::string>>;

/// What is known of the object itself, beside its name. It goes from the command line or the API into session.json, and
/// from there into bag-info.txt, the catalogue and the pictures that are made.
struct ObjectRecord {
    std::string inventory = {};  ///< its number in the collection, as the collection writes it; empty: none
    DublinCore dublin_core = {};

    bool empty() const { return inventory.empty() && dublin_core.empty(); }
    friend bool operator==(const ObjectRecord&, const ObjectRecord&) = default;
};

/// Adds a value. Throws InputError that begins with `where` for an element that Dublin Core does not have (the hint
/// lists them) and for a value that require_valid() refuses.
void add_value(const std::string& where, ObjectRecord& record, const std::string& element, const std::string& value);

/// Reads "title=A vase"; throws as add_value() does, and for a text without "=".
void add_assignment(const std::string& where, ObjectRecord& record, const std::string& text);

/// Throws InputError that begins with `where`: values are UTF-8 of 1 to 4000 bytes, with line breaks (LF) but no other
/// control character, at most 100 of them; the inventory number is one line of at most 200 bytes.
void require_valid(const std::string& where, const ObjectRecord& record);

}  // namespace darkbox
