// SPDX-License-Identifier: Apache-2.0
// What was assumed while a camera file was read, one sentence for each kind however many frames it concerns.
#pragma once

#include "runtime/cameras/json_fields.h"

#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

class CameraNotes {
public:
    explicit CameraNotes(std::string file) : m_file(std::move(file)) {}

    // `text` is told of the first object of each `kind`, with the number of objects. `where`: of the object.
    void add(const std::string& kind, const std::string& where, const std::string& text);
    // The keys of `object` that are not in `known` are named together.
    void addUnread(const JsonObject& object, std::span<const std::string_view> known);
    // After the last object: one sentence each, none where nothing was assumed.
    [[nodiscard]] std::vector<std::string> sentences() const;

private:
    struct Note {
        std::string text, last;
        size_t count = 0;
    };

    std::string m_file;
    std::map<std::string, Note> m_notes;
    std::set<std::string> m_unread;
};

} // namespace gsc
