// SPDX-License-Identifier: Apache-2.0
// One way to break a tiny file, and what a reader must say to it.
#pragma once

#include "tests/format/tiny_gsc.h"

#include <gsc/gsc_issues.h>
#include <gsc/gsc_reader.h>

#include <functional>
#include <set>
#include <vector>

namespace gsc::test {

using Bytes = std::vector<std::byte>;

enum class Seal { None, Header, All }; // checksums that are made true again after the change

struct Mutation {
    uint16_t id; // the issue it must raise
    std::function<void(Bytes&)> apply;
    std::set<uint16_t> also = {}; // issues that it raises besides; nothing else may come
    TinyGscOptions options = {};
    Seal seal = Seal::All;
};

// All cases of a region of the file; together they name every issue openGsc() can report.
std::vector<Mutation> tableMutations();
std::vector<Mutation> modelMutations();
std::vector<Mutation> chunkMutations();
std::vector<Mutation> weightMutations();
std::vector<Mutation> sensitivityMutations();
std::vector<Mutation> cameraMutations();
std::vector<Mutation> payloadMutations();

inline TinyGscOptions octree()
{
    TinyGscOptions options;
    options.levels = 2;
    return options;
}

// The file a mutation makes.
Bytes mutate(const Mutation& mutation);

struct Verdict {
    bool good;
    std::set<uint16_t> ids;
    std::vector<Issue> issues;
};

Verdict check(std::span<const std::byte> file, GscCheck check = GscCheck::Full);

// Recomputes the header's checksum and nothing else.
void resealHeader(std::span<std::byte> file);

// Most cases change one field of one record.
template <typename Record>
std::function<void(Bytes&)> edit(uint32_t type, size_t index, void (*change)(Record&))
{
    return [=](Bytes& file) { change(records<Record>(file, type)[index]); };
}

inline std::function<void(Bytes&)> editHeader(void (*change)(FileHeader&))
{
    return [=](Bytes& file) { change(header(file)); };
}

inline std::function<void(Bytes&)> editEntry(uint32_t type, void (*change)(SectionEntry&))
{
    return [=](Bytes& file) { change(*sectionEntry(file, type)); };
}

// Changes the list of sections and lays them out again.
inline std::function<void(Bytes&)> editSections(void (*change)(std::vector<TinySection>&))
{
    return [=](Bytes& file) {
        std::vector<TinySection> sections = takeApart(file);
        const FileHeader head = header(file);
        change(sections);
        file = assembleGsc(head, std::move(sections));
    };
}

inline TinySection& find(std::vector<TinySection>& sections, uint32_t type)
{
    for (TinySection& s : sections)
        if (s.entry.type == type)
            return s;
    std::abort();
}

inline std::set<uint16_t> operator+(std::set<uint16_t> a, uint16_t b)
{
    a.insert(b);
    return a;
}

} // namespace gsc::test
