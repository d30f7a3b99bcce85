// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/camera_notes.h"

#include <algorithm>

namespace gsc {

namespace {

constexpr size_t kMostNamed = 12; // keys

} // namespace

void CameraNotes::add(const std::string& kind, const std::string& where, const std::string& text)
{
    Note& note = m_notes[kind];
    if (note.count == 0)
        note.text = where + ": " + text;
    if (note.count == 0 || note.last != where)
        ++note.count;
    note.last = where;
}

void CameraNotes::addUnread(const JsonObject& object, std::span<const std::string_view> known)
{
    for (const std::string& key : object.keys())
        if (std::ranges::find(known, key) == known.end())
            m_unread.insert(key);
}

std::vector<std::string> CameraNotes::sentences() const
{
    std::vector<std::string> all;
    for (const auto& [kind, note] : m_notes)
        all.push_back(note.count == 1 ? note.text : note.text + formatString("; so in %zu places", note.count));
    if (m_unread.empty())
        return all;
    std::string names;
    size_t named = 0;
    for (const std::string& key : m_unread) {
        if (named++ == kMostNamed)
            break;
        names += (names.empty() ? "" : ", ") + shownJson(key);
    }
    if (m_unread.size() > kMostNamed)
        names += formatString(" and %zu more", m_unread.size() - kMostNamed);
    all.push_back(m_file + ": has " + names +
                  ", which no camera here is made of; poses and lenses are those of the other keys");
    return all;
}

} // namespace gsc
