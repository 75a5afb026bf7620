#include "rig/description/api_section.h"

#include <fmt/format.h>

namespace darkbox {

void read_api(TomlSection& section, RigDescription& rig) {
    section.allow({"sessions", "socket", "group", "listen", "token_file", "certificate", "key"});
    rig.sessions_folder = section.text("sessions").value_or("");
    rig.socket = section.text("socket").value_or("");
    rig.socket_group = section.text("group").value_or("");
    rig.listen = section.text("listen").value_or("");
    rig.token_file = section.text("token_file").value_or("");
    rig.certificate = section.text("certificate").value_or("");
    rig.key = section.text("key").value_or("");
    if (rig.certificate.empty() != rig.key.empty()) {
        const char* given = rig.key.empty() ? "certificate" : "key";
        const char* other = rig.key.empty() ? "key" : "certificate";
        section.fail(given, fmt::format("has {} without {}", given, other), "TLS needs both: name the two PEM files");
    }
}

}  // namespace darkbox
