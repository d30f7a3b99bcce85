// SPDX-License-Identifier: Apache-2.0
#include "convert/input/torch/zip_writer.h"

#include <gsc/error.h>

namespace gsc {

namespace {

constexpr uint64_t kPayloadAlignment = 64;
constexpr uint16_t kFlags = 0x0808; // flags: a data descriptor follows; names are UTF-8
// fields "made by" (0x031e) and "needed" (0x2d) of the zip64 record, as PyTorch writes them
constexpr uint64_t kEndVersions = 0x002d031e;

void put(std::vector<std::byte>& out, uint64_t value, size_t bytes)
{
    for (size_t i = 0; i < bytes; ++i)
        out.push_back(std::byte(value >> (8 * i)));
}

void putZeros(std::vector<std::byte>& out, size_t bytes)
{
    out.resize(out.size() + bytes);
}

void put(std::vector<std::byte>& out, const std::string& text)
{
    const auto* first = reinterpret_cast<const std::byte*>(text.data());
    out.insert(out.end(), first, first + text.size());
}

uint32_t crc32(std::span<const std::byte> bytes)
{
    uint32_t crc = ~0u;
    for (const std::byte byte : bytes) {
        crc ^= uint32_t(byte);
        for (int bit = 0; bit < 8; ++bit)
            crc = (crc >> 1) ^ ((crc & 1) ? 0xedb88320u : 0u);
    }
    return ~crc;
}

} // namespace

void ZipWriter::add(const std::string& member, std::span<const std::byte> content)
{
    const std::string name = m_folder + '/' + member;
    if (m_bytes.size() + content.size() + name.size() > 0xff000000u)
        throw Error(ErrorCode::Unsupported, name, "archive would pass 4 GiB", "the weights of small MLPs",
                    "write fewer or narrower ones");
    const uint32_t offset = uint32_t(m_bytes.size());
    put(m_bytes, 0x04034b50, 4);
    put(m_bytes, 0, 2); // version that a reader needs, 0
    put(m_bytes, kFlags, 2);
    putZeros(m_bytes, 2 + 2 + 2 + 4 + 4 + 4); // method, time, date, CRC and sizes, all 0
    put(m_bytes, name.size(), 2);
    const uint64_t unpadded = m_bytes.size() + 2 + name.size() + 4;
    const uint64_t padding = (kPayloadAlignment - unpadded % kPayloadAlignment) % kPayloadAlignment;
    put(m_bytes, 4 + padding, 2);
    put(m_bytes, name);
    put(m_bytes, std::string("FB"));
    put(m_bytes, padding, 2);
    put(m_bytes, std::string(padding, 'Z'));
    m_bytes.insert(m_bytes.end(), content.begin(), content.end());

    const Entry entry{name, crc32(content), uint32_t(content.size()), offset};
    put(m_bytes, 0x08074b50, 4);
    put(m_bytes, entry.crc, 4);
    put(m_bytes, entry.size, 4);
    put(m_bytes, entry.size, 4);
    m_entries.push_back(entry);
}

void ZipWriter::add(const std::string& member, const std::string& content)
{
    add(member, std::as_bytes(std::span(content)));
}

std::vector<std::byte> ZipWriter::finish()
{
    const uint64_t directory = m_bytes.size();
    for (const Entry& entry : m_entries) {
        put(m_bytes, 0x02014b50, 4);
        putZeros(m_bytes, 2 + 2); // versions, both 0
        put(m_bytes, kFlags, 2);
        putZeros(m_bytes, 2 + 2 + 2); // method, time and date, all 0
        put(m_bytes, entry.crc, 4);
        put(m_bytes, entry.size, 4);
        put(m_bytes, entry.size, 4);
        put(m_bytes, entry.name.size(), 2);
        putZeros(m_bytes, 2 + 2 + 2 + 2 + 4); // lengths of extra field and comment, disk number, attributes, all 0
        put(m_bytes, entry.offset, 4);
        put(m_bytes, entry.name);
    }
    const uint64_t directory_bytes = m_bytes.size() - directory;
    const uint64_t end64 = m_bytes.size();
    put(m_bytes, 0x06064b50, 4);
    put(m_bytes, 44, 8); // bytes of this record behind this field
    put(m_bytes, kEndVersions, 4);
    putZeros(m_bytes, 4 + 4); // disk numbers, both 0
    put(m_bytes, m_entries.size(), 8);
    put(m_bytes, m_entries.size(), 8);
    put(m_bytes, directory_bytes, 8);
    put(m_bytes, directory, 8);
    put(m_bytes, 0x07064b50, 4);
    put(m_bytes, 0, 4);
    put(m_bytes, end64, 8);
    put(m_bytes, 1, 4); // number of disks
    put(m_bytes, 0x06054b50, 4);
    putZeros(m_bytes, 2 + 2);
    put(m_bytes, m_entries.size(), 2);
    put(m_bytes, m_entries.size(), 2);
    put(m_bytes, directory_bytes, 4);
    put(m_bytes, directory, 4);
    put(m_bytes, 0, 2); // length of the comment
    return std::move(m_bytes);
}

} // namespace gsc
