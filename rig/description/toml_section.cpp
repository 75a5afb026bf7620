#include "rig/description/toml_section.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "acquisition/frame/error.h"
#include "rig/description/nearest_word.h"

namespace darkbox {
namespace {

constexpr std::size_t longest_quoted_key = 40;

/// Keys come from outside: an endless one must not fill the message.
std::string in_quotes(const std::string& key) {
    return "'" + (key.size() <= longest_quoted_key ? key : key.substr(0, longest_quoted_key) + "...") + "'";
}

std::string type_name(const toml::node& node) {
    switch (node.type()) {
        case toml::node_type::table:
            return "a table";
        case toml::node_type::array:
            return "an array";
        case toml::node_type::string:
            return "text";
        case toml::node_type::integer:
            return "a whole number";
        case toml::node_type::floating_point:
            return "a number";
        case toml::node_type::boolean:
            return "true or false";
        default:
            return "a date or time";
    }
}

template <typename Number>
std::string range_text(Allowed<Number> allowed) {
    if (allowed.most == std::numeric_limits<Number>::max()) return fmt::format("at least {}", allowed.least);
    return fmt::format("{} to {}", allowed.least, allowed.most);
}

}  // namespace

TomlSection::TomlSection(const toml::table& table, std::string title, std::string origin)
    : table_(&table), title_(std::move(title)), origin_(std::move(origin)) {}

void TomlSection::allow(const std::set<std::string>& keys, const std::string& kind) {
    known_ = keys;
    const toml::node* first = nullptr;
    std::string first_key;
    for (const auto& [key, node] : *table_) {
        if (known_.count(std::string(key.str())) != 0) continue;
        if (first != nullptr && first->source().begin.line <= node.source().begin.line) continue;
        first = &node;
        first_key = key.str();
    }
    if (first == nullptr) return;
    const std::string near = nearest_word(first_key, known_);
    throw InputError(fmt::format("{}: unknown {} {} in {}{}", place(first->source()), kind, in_quotes(first_key),
                                 title_, near.empty() ? "" : fmt::format("; did you mean '{}'?", near)),
                     known_.empty() ? fmt::format("{} has no keys; remove it", title_)
                                    : fmt::format("{} knows: {}", title_, fmt::join(known_, ", ")));
}

const toml::node* TomlSection::find(const std::string& key) const {
    if (known_.count(key) == 0) throw std::logic_error(title_ + " reads '" + key + "' without allowing it");
    return table_->get(key);
}

std::string TomlSection::place(const toml::source_region& source) const {
    return fmt::format("{}:{}", origin_, std::max<toml::source_index>(source.begin.line, 1));
}

void TomlSection::fail(const std::string& key, const std::string& problem, const std::string& hint) const {
    const toml::node* node = table_->get(key);
    const toml::source_region& source = node != nullptr ? node->source() : table_->source();
    throw InputError(fmt::format("{}: {} {}", place(source), title_, problem), hint);
}

void TomlSection::wrong_type(const std::string& key, const toml::node& node, const std::string& wanted) const {
    fail(key, fmt::format("{} must be {}, but is {}", key, wanted, type_name(node)),
         fmt::format("write {} as {}", key, wanted));
}

std::optional<std::string> TomlSection::text(const std::string& key) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    if (!node->is_string()) wrong_type(key, *node, "text in quotes");
    return node->as_string()->get();
}

std::string TomlSection::required_text(const std::string& key) {
    std::optional<std::string> value = text(key);
    if (!value) fail(key, key + " is missing", fmt::format("add {} = \"...\" to {}", key, title_));
    if (value->empty()) fail(key, key + " is empty", fmt::format("give {} a value", key));
    return *value;
}

std::optional<std::string> TomlSection::text_or_digits(const std::string& key) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    if (node->is_integer()) return std::to_string(*integer(key, {0, std::numeric_limits<std::int32_t>::max()}));
    if (!node->is_string()) wrong_type(key, *node, "a name in quotes or a whole number");
    return node->as_string()->get();
}

std::vector<std::string> TomlSection::texts_or_digits(const std::string& key) {
    const toml::node* node = find(key);
    if (node == nullptr) return {};
    const std::string wanted = "names in quotes or whole numbers, in brackets";
    if (!node->is_array()) wrong_type(key, *node, wanted);
    std::vector<std::string> texts;
    for (const toml::node& element : *node->as_array()) {
        if (element.is_string())
            texts.push_back(element.as_string()->get());
        else if (element.is_integer() && element.as_integer()->get() >= 0)
            texts.push_back(std::to_string(element.as_integer()->get()));
        else
            wrong_type(key, element, wanted);
    }
    return texts;
}

std::string TomlSection::choice(const std::string& key, const std::string& fallback,
                                const std::vector<std::string>& choices) {
    const std::string value = text(key).value_or(fallback);
    if (std::find(choices.begin(), choices.end(), value) == choices.end()) {
        const std::string allowed = fmt::format("\"{}\"", fmt::join(choices, "\", \""));
        fail(key, fmt::format("{} is {}; allowed: {}", key, in_quotes(value), allowed),
             fmt::format("choose one of {}", allowed));
    }
    return value;
}

std::optional<double> TomlSection::number(const std::string& key, Allowed<double> allowed) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    if (!node->is_number()) wrong_type(key, *node, "a number");
    const double value =
        node->is_integer() ? static_cast<double>(node->as_integer()->get()) : node->as_floating_point()->get();
    // Negated, so that NaN fails too.
    if (!(value >= allowed.least && value <= allowed.most))
        fail(key, fmt::format("{} is {}; allowed: {}", key, value, range_text(allowed)),
             fmt::format("choose a value that is {}", range_text(allowed)));
    return value;
}

std::optional<std::int64_t> TomlSection::integer(const std::string& key, Allowed<std::int64_t> allowed) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    if (!node->is_integer()) wrong_type(key, *node, "a whole number");
    const std::int64_t value = node->as_integer()->get();
    if (value < allowed.least || value > allowed.most)
        fail(key, fmt::format("{} is {}; allowed: {}", key, value, range_text(allowed)),
             fmt::format("choose a whole number that is {}", range_text(allowed)));
    return value;
}

std::optional<bool> TomlSection::flag(const std::string& key) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    if (!node->is_boolean()) wrong_type(key, *node, "true or false");
    return node->as_boolean()->get();
}

std::optional<std::vector<double>> TomlSection::numbers(const std::string& key, std::size_t count) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    const std::string wanted = fmt::format("{} numbers in brackets", count);
    const toml::array* array = node->as_array();
    if (array == nullptr || array->size() != count) wrong_type(key, *node, wanted);
    std::vector<double> values;
    for (const toml::node& element : *array) {
        if (!element.is_number()) wrong_type(key, element, wanted);
        const double value = *element.value<double>();
        if (!std::isfinite(value))
            fail(key, fmt::format("{} has the element {}; allowed: finite numbers", key, value),
                 "write finite numbers");
        values.push_back(value);
    }
    return values;
}

std::vector<double> TomlSection::numbers_up_to(const std::string& key, std::size_t most) {
    const toml::node* node = find(key);
    const toml::array* array = node == nullptr ? nullptr : node->as_array();
    const std::size_t count = array == nullptr ? 0 : array->size();
    if (node != nullptr && (count < 1 || count > most))
        wrong_type(key, *node, fmt::format("1 to {} numbers in brackets", most));
    return numbers(key, count).value_or(std::vector<double>());
}

std::optional<TomlSection> TomlSection::section(const std::string& key, const std::string& title) {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    if (!node->is_table()) wrong_type(key, *node, "a table, " + title);
    return TomlSection(*node->as_table(), title, origin_);
}

std::vector<TomlSection> TomlSection::sections(const std::string& key, const std::string& title) {
    const toml::node* node = find(key);
    if (node == nullptr) return {};
    if (!node->is_array()) wrong_type(key, *node, "a list of tables, " + title);
    std::vector<TomlSection> tables;
    for (const toml::node& element : *node->as_array()) {
        if (!element.is_table()) wrong_type(key, element, "a list of tables, " + title);
        tables.emplace_back(*element.as_table(), title, origin_);
    }
    return tables;
}

}  // namespace darkbox
