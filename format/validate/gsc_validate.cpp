// SPDX-License-Identifier: Apache-2.0
#include "format/validate/gsc_validate.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace gsc::validate {

IssueLog::IssueLog(const IssueSink& sink) : m_sink(sink) {}

bool IssueLog::count(uint16_t id)
{
    const IssueInfo& info = issueInfo(id);
    m_errors += info.severity != Severity::Warning;
    m_fatal |= info.severity == Severity::Fatal;
    return ++m_count.at(size_t(&info - allIssues().data())) <= kMaxIssuesPerId && m_sink;
}

void IssueLog::emit(uint16_t id, uint64_t offset, std::string pointer, std::string detail)
{
    m_sink(Issue{&issueInfo(id), offset, std::move(pointer), std::move(detail)});
}

const SectionEntry* Context::entry(uint32_t type) const
{
    for (const SectionEntry& entry : view.sections)
        if (entry.type == type)
            return &entry;
    return nullptr;
}

std::span<const std::byte> Context::content(const SectionEntry& entry) const
{
    return file.slice(entry.offset, entry.bytes).value_or(std::span<const std::byte>{});
}

uint64_t Context::offsetOf(uint32_t type) const
{
    const SectionEntry* const found = entry(type);
    return found ? found->offset : 0;
}

std::string place(const char* array, uint64_t index, const char* field)
{
    return formatString("/%s/%" PRIu64 "%s%s", array, index, *field ? "/" : "", field);
}

bool allFinite(std::span<const float> values)
{
    // note: works on the bits and without a branch, so that it is vectorised; every float of a file passes here
    uint32_t bad = 0;
    for (const float value : values)
        bad |= uint32_t((std::bit_cast<uint32_t>(value) & 0x7f800000u) == 0x7f800000u);
    return bad == 0;
}

size_t zeroPrefix(std::span<const std::byte> bytes)
{
    return size_t(std::find_if(bytes.begin(), bytes.end(), [](std::byte b) { return b != std::byte{0}; }) -
                  bytes.begin());
}

bool orderedFinite(float low, float high)
{
    return std::isfinite(low) && std::isfinite(high) && low <= high;
}

bool mortonLess(const int32_t (&a)[3], const int32_t (&b)[3])
{
    // the axis whose coordinates differ in the highest bit decides; if two axes differ in the same bit, the later axis,
    // whose bit lies higher in the key
    uint32_t best = 0;
    bool less = false;
    for (int axis = 0; axis < 3; ++axis) {
        const uint32_t u = uint32_t(a[axis]) ^ 0x80000000u, v = uint32_t(b[axis]) ^ 0x80000000u;
        const uint32_t difference = u ^ v;
        if (difference != 0 && std::bit_floor(difference) >= best) {
            best = std::bit_floor(difference);
            less = u < v;
        }
    }
    return less;
}

} // namespace gsc::validate
