#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "rig/description/rig_description.h"

namespace darkbox {

/// The light that objects have had, kept beside the sessions: a line of JSON for each share of light, added and never
/// changed, so that the sums can be made again at any time and deleting a session forgets nothing.
/// Thread-compatible; several books may write to one file.
class DoseBook {
public:
    /// FOLDER/.darkbox/dose.jsonl. Throws InputError for a file with a line that tells no dose: what was spent is not
    /// known then. Lines that a crash cut off are passed over.
    explicit DoseBook(const std::filesystem::path& sessions_folder);

    LightDose spent(const std::string& object) const;
    const std::map<std::string, LightDose>& objects() const { return spent_; }

    /// Throws DeviceError when it cannot be written.
    void add(const std::string& object, const std::string& session, const LightDose& dose);
    /// Until power loss cannot take back what was added. Throws DeviceError.
    void flush() const;

private:
    void read();

    std::filesystem::path file_;
    std::map<std::string, LightDose> spent_;
    bool torn_ = false;  ///< the file ends within a line
};

}  // namespace darkbox
