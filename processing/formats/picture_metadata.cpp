#include "processing/formats/picture_metadata.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <exiv2/exiv2.hpp>
#include <mutex>
#include <span>

#include "acquisition/frame/error.h"
#include "processing/formats/atomic_file.h"
#include "processing/formats/picture.h"

namespace darkbox {
namespace {

using Values = std::vector<std::string>;

/// How XMP types the elements of Dublin Core (ISO 16684-1, 8.3).
enum class Form { language_alternative, sequence, bag, text };
struct Element {
    const char* name;
    Form form;
};
constexpr Element elements[]{{"contributor", Form::bag},
                             {"coverage", Form::text},
                             {"creator", Form::sequence},
                             {"date", Form::sequence},
                             {"description", Form::language_alternative},
                             {"format", Form::text},
                             {"identifier", Form::text},
                             {"language", Form::bag},
                             {"publisher", Form::bag},
                             {"relation", Form::bag},
                             {"rights", Form::language_alternative},
                             {"source", Form::text},
                             {"subject", Form::bag},
                             {"title", Form::language_alternative},
                             {"type", Form::bag}};

/// Of one element, in one text, where only one has room.
std::string joined(const Values& values) { return fmt::format("{}", fmt::join(values, "; ")); }

Values values_of(const PictureMetadata& metadata, const std::string& element) {
    if (const auto found = metadata.dublin_core.find(element); found != metadata.dublin_core.end())
        return found->second;
    if (element == "title" && !metadata.object.empty()) return {metadata.object};
    if (element == "identifier" && !metadata.inventory.empty()) return {metadata.inventory};
    return {};
}

void add_text(Exiv2::XmpData& xmp, const std::string& key, const std::string& text) {
    if (text.empty()) return;
    const Exiv2::XmpTextValue value(text);
    xmp.add(Exiv2::XmpKey(key), &value);
}

void add_list(Exiv2::XmpData& xmp, const std::string& key, const Values& values, Exiv2::TypeId type) {
    if (values.empty()) return;
    Exiv2::XmpArrayValue list(type);
    for (const std::string& value : values) list.read(value);
    xmp.add(Exiv2::XmpKey(key), &list);
}

void add_element(Exiv2::XmpData& xmp, const Element& element, const Values& values) {
    if (values.empty()) return;
    const std::string key = fmt::format("Xmp.dc.{}", element.name);
    switch (element.form) {
        case Form::language_alternative: {
            Exiv2::LangAltValue value;
            value.value_["x-default"] = joined(values);
            xmp.add(Exiv2::XmpKey(key), &value);
            return;
        }
        case Form::sequence:
            return add_list(xmp, key, values, Exiv2::xmpSeq);
        case Form::bag:
            return add_list(xmp, key, values, Exiv2::xmpBag);
        case Form::text:
            return add_text(xmp, key, joined(values));
    }
}

Exiv2::XmpData xmp_of(const PictureMetadata& metadata) {
    Exiv2::XmpData xmp;
    for (const Element& element : elements) add_element(xmp, element, values_of(metadata, element.name));
    add_text(xmp, "Xmp.xmp.CreatorTool", metadata.software);
    for (const auto& [name, text] : metadata.provenance) add_text(xmp, "Xmp.darkbox." + name, text);
    return xmp;
}

/// No character is cut through.
std::string cut(std::string text, std::size_t most) {
    if (text.size() <= most) return text;
    while (most > 0 && (static_cast<unsigned char>(text[most]) & 0xC0) == 0x80) --most;
    text.resize(most);
    return text;
}

void add_iptc(Exiv2::IptcData& iptc, const std::string& key, const std::string& text, std::size_t most) {
    if (text.empty()) return;
    Exiv2::StringValue value(cut(text, most));
    iptc.add(Exiv2::IptcKey(key), &value);
}

/// IPTC-IIM 4.2: data sets and the octets that each may have.
Exiv2::IptcData iptc_of(const PictureMetadata& metadata) {
    Exiv2::IptcData iptc;
    iptc["Iptc.Envelope.CharacterSet"] = "\x1b%G";  // UTF-8
    add_iptc(iptc, "Iptc.Application2.ObjectName", joined(values_of(metadata, "title")), 64);
    for (const std::string& creator : values_of(metadata, "creator"))
        add_iptc(iptc, "Iptc.Application2.Byline", creator, 32);
    for (const std::string& subject : values_of(metadata, "subject"))
        add_iptc(iptc, "Iptc.Application2.Keywords", subject, 64);
    add_iptc(iptc, "Iptc.Application2.Caption", joined(values_of(metadata, "description")), 2000);
    add_iptc(iptc, "Iptc.Application2.Copyright", joined(values_of(metadata, "rights")), 128);
    add_iptc(iptc, "Iptc.Application2.Source", joined(values_of(metadata, "source")), 32);
    add_iptc(iptc, "Iptc.Application2.Program", metadata.software, 32);
    return iptc;
}

std::vector<std::byte> rewritten(std::span<const std::byte> picture, const PictureMetadata& metadata) {
    const auto image = Exiv2::ImageFactory::open(reinterpret_cast<const Exiv2::byte*>(picture.data()), picture.size());
    image->readMetadata();
    image->setXmpData(xmp_of(metadata));
    // PNG has no place for it that others would look into.
    if (image->mimeType() != "image/png") image->setIptcData(iptc_of(metadata));
    image->writeMetadata();
    Exiv2::BasicIo& io = image->io();
    io.open();
    const auto* bytes = reinterpret_cast<const std::byte*>(io.mmap());
    return {bytes, bytes + io.size()};
}

}  // namespace

std::vector<std::byte> with_metadata(const std::vector<std::byte>& picture, const PictureMetadata& metadata,
                                     const std::string& file) {
    // Exiv2's XMP parser has a state of its own.
    static std::mutex mutex;
    const std::scoped_lock lock(mutex);
    static const bool ready = [] {
        Exiv2::LogMsg::setLevel(Exiv2::LogMsg::mute);
        Exiv2::XmpParser::initialize();
        Exiv2::XmpProperties::registerNs(provenance_namespace, "darkbox");
        return true;
    }();
    (void)ready;
    try {
        return rewritten(picture, metadata);
    } catch (const std::exception& error) {  // Exiv2's own have another name in each of its versions
        throw InputError(fmt::format("cannot put metadata into {}: {}", file, error.what()),
                         "is it a whole PNG, JPEG or TIFF?");
    }
}

void embed_metadata(const std::filesystem::path& picture, const PictureMetadata& metadata) {
    const auto format = picture_format_of(picture);
    if (!format || *format == PictureFormat::exr) return;
    write_file(picture, std::span<const std::byte>(with_metadata(read_file(picture), metadata, picture.string())));
}

}  // namespace darkbox
