// SPDX-License-Identifier: Apache-2.0
#include "convert/input/torch/pickle_input.h"

#include "format/error.h"

#include <algorithm>

namespace gsc {

void PickleInput::invalid(const std::string& text) const
{
    throw Error(ErrorCode::InvalidFile,
                formatString("%s: %s at byte %zu of the pickle, expected what PyTorch writes; save it again",
                             m_name.c_str(), text.c_str(), m_at));
}

void PickleInput::unsupported(const std::string& what) const
{
    throw Error(ErrorCode::Unsupported,
                formatString("%s: pickle holds %s (byte %zu), expected only tensors, modules and state dictionaries; "
                             "export the state_dict of the MLPs with torch.save",
                             m_name.c_str(), what.c_str(), m_at));
}

void PickleInput::limitSize(size_t max_bytes) const
{
    if (m_bytes.size() > max_bytes)
        invalid(formatString("pickle of %zu bytes, at most %zu are read", m_bytes.size(), max_bytes));
}

uint8_t PickleInput::takeOpcode()
{
    m_at = m_cursor;
    return uint8_t(take(1)[0]);
}

std::span<const std::byte> PickleInput::take(size_t count)
{
    if (count > m_bytes.size() - m_cursor)
        invalid("pickle ends too early");
    const auto part = m_bytes.subspan(m_cursor, count);
    m_cursor += count;
    return part;
}

uint64_t PickleInput::takeUnsigned(size_t count)
{
    uint64_t value = 0;
    const auto part = take(count);
    for (size_t i = 0; i < count; ++i)
        value |= uint64_t(part[i]) << (8 * i);
    return value;
}

std::string PickleInput::takeText(size_t count)
{
    const auto part = take(count);
    return {reinterpret_cast<const char*>(part.data()), part.size()};
}

std::string PickleInput::takeLine(size_t max_characters)
{
    const auto rest = m_bytes.subspan(m_cursor, std::min(m_bytes.size() - m_cursor, max_characters + 1));
    const auto end = std::find(rest.begin(), rest.end(), std::byte('\n'));
    if (end == rest.end())
        invalid("unterminated or overlong name");
    std::string line = takeText(size_t(end - rest.begin()));
    ++m_cursor;
    return line;
}

} // namespace gsc
