// SPDX-License-Identifier: Apache-2.0
// Checks behind openGsc(), one function per region of the file. Only for format/; callers use gsc_reader.h.
#pragma once

#include <gsc/byte_view.h>
#include <gsc/error.h>
#include <gsc/gsc_issues.h>
#include <gsc/gsc_reader.h>

#include <array>
#include <string>

namespace gsc::validate {

// Largest number of issues of one id that reach the sink: a damaged array has millions of them.
constexpr uint32_t kMaxIssuesPerId = 16;

class IssueLog {
public:
    explicit IssueLog(const IssueSink& sink);

    // Counts an issue; returns true if its text is wanted, false beyond kMaxIssuesPerId.
    [[nodiscard]] bool count(uint16_t id);
    void emit(uint16_t id, uint64_t offset, std::string pointer, std::string detail);

    // number of issues so far that are an Error or Fatal
    [[nodiscard]] uint64_t errors() const noexcept { return m_errors; }
    [[nodiscard]] bool fatal() const noexcept { return m_fatal; }

private:
    const IssueSink& m_sink;
    std::array<uint32_t, 256> m_count{}; // number of issues of each id, in the order of the table
    uint64_t m_errors = 0;
    bool m_fatal = false;
};

// Reports the issue `name`. `pointer` is formatted only if the issue is shown; the compiler checks the values against
// the format in the table.
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

    // Entry of a known section in the section table, null if absent. After checkTable() a type occurs only once.
    [[nodiscard]] const SectionEntry* entry(uint32_t type) const;
    // bytes of the section; to be called after checkTable()
    [[nodiscard]] std::span<const std::byte> content(const SectionEntry& entry) const;
    [[nodiscard]] uint64_t offsetOf(uint32_t type) const; // place of the section in the file, 0 if absent
};

// The checks, in the order in which they must be called. Those that return bool return false if later checks cannot
// rely on what they checked.
bool checkHeader(Context& context);
bool checkTable(Context& context);
void checkPadding(Context& context);
[[nodiscard]] bool checkHeaderChecksum(Context& context, const FileHeader& header, std::span<const std::byte> table);
// Yes: only META, PARM and LEVL; No: all but ANCH and DATA, whose checksums are of those of their parts
enum class SummaryOnly { No, Yes };
void checkSectionChecksums(Context& context, SummaryOnly summary);
// checks the checksum of ANCH, which is that of the checksums of all chunks
void checkAnchorsChecksum(Context& context, const SectionEntry& anchors);
void checkChunkChecksum(IssueLog& log, const ChunkRecord& chunk, uint32_t index, std::span<const std::byte> payload,
                        uint64_t payload_at);
void checkManifest(Context& context);
bool checkParams(Context& context);
bool checkLevels(Context& context);
bool bindSections(Context& context); // fills the spans of the view from sizes and counts; false if one does not fit
void checkNanoVdb(Context& context);
// The next three return false if a range is wrong; a wrong value that is no range is reported, but does not count.
bool checkChunks(Context& context);
bool checkGroups(Context& context);
bool checkLeaves(Context& context);
void checkIndex(Context& context);
// `ranges_sound`: whether checkChunks() and checkGroups() returned true.
void checkSensitivity(Context& context, bool ranges_sound);
void checkTile(Context& context);
bool checkMlps(Context& context);          // returns false if a shape or an offset is wrong
bool checkPacked(Context& context);        // returns false if a shape or an offset is wrong
void checkPackedContent(Context& context); // precondition: checkMlps() and checkPacked() returned true
void checkEmbedding(Context& context);
void checkCameras(Context& context);
void checkPayloads(Context& context); // precondition: the ranges of chunks, groups and leaves are sound

// Functions that several checks use.
std::string place(const char* array, uint64_t index, const char* field);
[[nodiscard]] bool allFinite(std::span<const float> values);
// Position of the first byte that is not zero, or bytes.size().
size_t zeroPrefix(std::span<const std::byte> bytes);
[[nodiscard]] bool orderedFinite(float low, float high);
// Returns true if `a` comes before `b` in Morton order, x in the lowest bit of each three; coordinates may be negative.
bool mortonLess(const int32_t (&a)[3], const int32_t (&b)[3]);

} // namespace gsc::validate
