// SPDX-License-Identifier: Apache-2.0
// The checks behind openGsc(), one function per region of the file. Internal to format/; callers use gsc_reader.h.
#pragma once

#include <gsc/byte_view.h>
#include <gsc/error.h>
#include <gsc/gsc_issues.h>
#include <gsc/gsc_reader.h>

#include <array>
#include <string>

namespace gsc::validate {

// At most this many issues of one id reach the sink: a damaged array has millions of them.
constexpr uint32_t kMaxIssuesPerId = 16;

class IssueLog {
public:
    explicit IssueLog(const IssueSink& sink);

    // Counts the issue, and says if its text is wanted.
    [[nodiscard]] bool count(uint16_t id);
    void emit(uint16_t id, uint64_t offset, std::string pointer, std::string detail);

    [[nodiscard]] uint64_t errors() const noexcept { return m_errors; } // Error or Fatal so far
    [[nodiscard]] bool fatal() const noexcept { return m_fatal; }

private:
    const IssueSink& m_sink;
    std::array<uint32_t, 256> m_count{}; // issues of each number, by place in the table
    uint64_t m_errors = 0;
    bool m_fatal = false;
};

// `pointer` is formatted only if the issue is shown; the compiler checks the values against the table's format.
#define GSC_REPORT(log, name, offset, pointer, ...)                                                                    \
    do {                                                                                                               \
        if ((log).count(::gsc::issue::name))                                                                           \
            (log).emit(::gsc::issue::name, (offset), (pointer),                                                        \
                       ::gsc::formatString(::gsc::issue_detail::name, __VA_ARGS__));                                   \
    } while (false)

struct Context {
    ByteView file;
    GscView& view;
    IssueLog& log;
    Profile profile = Profile::Runtime; // profile that the file must have

    // The entry of a known section, null if absent. Unique after checkTable().
    [[nodiscard]] const SectionEntry* entry(uint32_t type) const;
    [[nodiscard]] std::span<const std::byte> content(const SectionEntry& entry) const; // after checkTable()
    [[nodiscard]] uint64_t offsetOf(uint32_t type) const;                              // 0 if absent
};

// In this order. Those that return bool return false if what they check cannot be relied on by the next ones.
bool checkHeader(Context& context);
bool checkTable(Context& context);
void checkPadding(Context& context);
[[nodiscard]] bool checkHeaderChecksum(Context& context, const FileHeader& header, std::span<const std::byte> table);
// No: all but ANCH and DATA, whose entries cover those of their parts; Yes: META, PARM, LEVL
enum class SummaryOnly { No, Yes };
void checkSectionChecksums(Context& context, SummaryOnly summary);
void checkAnchorsChecksum(Context& context, const SectionEntry& anchors); // over those of all chunks
void checkChunkChecksum(IssueLog& log, const ChunkRecord& chunk, uint32_t index, std::span<const std::byte> payload,
                        uint64_t payload_at);
void checkManifest(Context& context);
bool checkParams(Context& context);
bool checkLevels(Context& context);
bool bindSections(Context& context); // spans of the view, from sizes and counts
void checkNanoVdb(Context& context);
// these three: false if a range is wrong; a wrong value alone is reported and does not count
bool checkChunks(Context& context);
bool checkGroups(Context& context);
bool checkLeaves(Context& context);
void checkIndex(Context& context);
// whether the ranges of chunks and groups are sound
void checkSensitivity(Context& context, bool ranges_sound);
void checkTile(Context& context);
bool checkMlps(Context& context);          // false if a shape or an offset is wrong
bool checkPacked(Context& context);        // the same
void checkPackedContent(Context& context); // precondition: the two returned true
void checkEmbedding(Context& context);
void checkCameras(Context& context);
void checkPayloads(Context& context); // precondition: the ranges of chunks, groups and leaves are sound

// Shared by the parts.
std::string place(const char* array, uint64_t index, const char* field);
[[nodiscard]] bool allFinite(std::span<const float> values);
// Position of the first byte that is not zero, or bytes.size().
size_t zeroPrefix(std::span<const std::byte> bytes);
[[nodiscard]] bool orderedFinite(float low, float high);
// Whether a precedes b in Morton order, x in the lowest bit of each triple; signed coordinates.
bool mortonLess(const int32_t (&a)[3], const int32_t (&b)[3]);

} // namespace gsc::validate
