#pragma once

#include <toml++/toml.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace darkbox {

/// A closed range of numbers that a key may have; infinite where open.
template <typename Number>
struct Allowed {
    Number least = std::numeric_limits<Number>::lowest();
    Number most = std::numeric_limits<Number>::max();
};

/// One table of a TOML file, read strictly: allow() names the keys it may have, and every value is checked for type and
/// range as it is read. Reading a key that was not allowed is a std::logic_error, so the two cannot drift apart.
/// Private to this folder, so that toml++ stays behind it. Refers to the table; thread-compatible.
class TomlSection {
public:
    /// `title` is how messages name the table, such as "[camera]"; `origin` is the file's name.
    TomlSection(const toml::table& table, std::string title, std::string origin);

    /// Any other key is an InputError that names its line and the nearest of these. `kind` is what the message calls
    /// it.
    void allow(const std::set<std::string>& keys, const std::string& kind = "key");

    std::optional<std::string> text(const std::string& key);
    std::string required_text(const std::string& key);
    /// A name or a number, such as a GPIO line; a number comes back as its digits.
    std::optional<std::string> text_or_digits(const std::string& key);
    /// A list of them; empty where there is none.
    std::vector<std::string> texts_or_digits(const std::string& key);
    std::string choice(const std::string& key, const std::string& fallback, const std::vector<std::string>& choices);
    std::optional<double> number(const std::string& key, Allowed<double> allowed);
    std::optional<std::int64_t> integer(const std::string& key, Allowed<std::int64_t> allowed);
    std::optional<bool> flag(const std::string& key);
    /// Exactly `count` finite numbers.
    std::optional<std::vector<double>> numbers(const std::string& key, std::size_t count);
    /// One to `most` finite numbers.
    std::vector<double> numbers_up_to(const std::string& key, std::size_t most);
    /// No value where the table is absent.
    std::optional<TomlSection> section(const std::string& key, const std::string& title);
    /// The tables of [[key]], in order; `title` names each in messages. Empty where there are none.
    std::vector<TomlSection> sections(const std::string& key, const std::string& title);

    bool has(const std::string& key) const { return table_->contains(key); }
    /// An InputError at the key's line, or at the table's own where the key is absent.
    [[noreturn]] void fail(const std::string& key, const std::string& problem, const std::string& hint) const;

private:
    const toml::node* find(const std::string& key) const;
    [[noreturn]] void wrong_type(const std::string& key, const toml::node& node, const std::string& wanted) const;
    std::string place(const toml::source_region& source) const;

    const toml::table* table_;
    std::string title_;
    std::string origin_;
    std::set<std::string> known_;
};

}  // namespace darkbox
