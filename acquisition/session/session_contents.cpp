#include "acquisition/session/session_contents.h"

#include <fmt/format.h>

#include <utility>

#include "acquisition/frame/error.h"
#include "acquisition/session/record_checks.h"

namespace darkbox {
namespace {

template <typename... F>
struct Overloaded : F... {
    using F::operator()...;
};
template <typename... F>
Overloaded(F...) -> Overloaded<F...>;

}  // namespace

void SessionContents::apply(const JournalEntry& entry) {
    std::visit(Overloaded{
                   [this](const FrameEntry& frame) {
                       add_payload({frame.record.file, frame.size, frame.record.sha256});
                       frames.push_back(frame.record);
                   },
                   [this](const Payload& extra) { add_payload(extra); },
                   [this](const SessionEvent& event) { events.push_back(event); },
                   [this](const NoteEntry& note) { info.notes.push_back(note.note); },
                   [this](const WithdrawnEntry& withdrawn) { withdraw(withdrawn.file); },
               },
               entry);
}

void SessionContents::add_payload(Payload payload) {
    if (!names.insert(payload.name).second)
        throw InputError(fmt::format("the session holds {} already", shown(payload.name)),
                         "nothing in a session is ever replaced; give the file another name");
    payloads.push_back(std::move(payload));
}

void SessionContents::withdraw(const std::string& file) {
    if (std::erase_if(frames, [&](const FrameRecord& record) { return record.file == file; }) == 0)
        throw InputError(fmt::format("the session has no frame {} to withdraw", shown(file)), "the journal is damaged");
    std::erase_if(payloads, [&](const Payload& payload) { return payload.name == file; });
    names.erase(file);
}

}  // namespace darkbox
