#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "rig/daemon/api.h"
#include "rig/daemon/catalog.h"

namespace darkbox {

/// The request does not fit the API: an HTTP status other than 400.
struct Rejected {
    int status;
    std::string detail;
    std::string hint;
    std::string allow = {};
};

std::string dump(const nlohmann::json& json);
ApiResponse reply(const nlohmann::json& json, int status = 200);
/// Throws InputError for what is not digits only.
std::uint64_t number(std::string_view text, const std::string& what);

nlohmann::json to_json(const CatalogFrame& frame);
nlohmann::json to_json(const CatalogCalibration& calibration);
nlohmann::json to_json(const CatalogDrift& drift);

/// The file, or the range of it that was asked for (one range; RFC 9110), or 304 or 416.
ApiResponse answer_with_file(OpenFile file, const std::string& content_type, const ApiRequest& request);
/// By the name's ending.
std::string content_type_of(const std::string& name);

}  // namespace darkbox
