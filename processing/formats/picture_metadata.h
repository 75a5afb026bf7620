#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace darkbox {

/// What a picture says of what it shows and of how it was made. Everything is UTF-8; empty texts are left out.
struct PictureMetadata {
    std::string object;                                           ///< its name; the title where Dublin Core has none
    std::string inventory;                                        ///< the identifier where Dublin Core has none
    std::map<std::string, std::vector<std::string>> dublin_core;  ///< element: values; unknown elements are left out
    std::string software;                                         ///< "darkbox 1.2.3"
    /// Of the session and the processing, as "darkbox:Solver" = "robust".
    std::vector<std::pair<std::string, std::string>> provenance;
};

/// The namespace of `provenance`.
inline constexpr const char* provenance_namespace = "urn:darkbox:provenance:1.0:";

/// The picture with an XMP packet (ISO 16684-1: PNG iTXt "XML:com.adobe.xmp", JPEG APP1, TIFF tag 700) and, in JPEG and
/// TIFF, IPTC-IIM for programs that know no XMP, cut to the lengths that it allows. Samples stay as they are. The same
/// input gives the same bytes. `file` is for messages. Throws InputError for what is not such a picture. Thread-safe.
std::vector<std::byte> with_metadata(const std::vector<std::byte>& picture, const PictureMetadata& metadata,
                                     const std::string& file);

/// The same for a file, which is replaced as a whole. EXR and other formats are left as they are.
void embed_metadata(const std::filesystem::path& picture, const PictureMetadata& metadata);

}  // namespace darkbox
