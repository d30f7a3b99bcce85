// SPDX-License-Identifier: Apache-2.0
#include "convert/input/torch/zip_archive.h"

#include <gsc/error.h>

#include <zip.h>

#include <algorithm>
#include <iterator>

namespace gsc {

// libzip is used and no reader of our own, because it opened every member of all 22 .pt files of six trained models
// (PyTorch 2.11) and of files of PyTorch 1.13, also with ZIP_CHECKCONS. Those have zero sizes and CRCs in local
// headers, data descriptors, DOS date 0, the extra field FB and ZIP64 end records. It also checks every CRC-32.

namespace {

constexpr zip_int64_t kMaxMembers = 65536; // files of PyTorch have about 20
constexpr uint64_t kMostInflated = 1032;

} // namespace

void ZipArchive::invalid(const std::string& text) const
{
    throw Error(ErrorCode::InvalidFile, m_name, text, "a complete PyTorch archive", "save it again");
}

zip_stat_t ZipArchive::stat(const std::string& member) const
{
    const auto found = m_index.find(member);
    if (found == m_index.end())
        invalid("archive has no member '" + member + "'");
    zip_stat_t result;
    zip_stat_init(&result);
    constexpr zip_uint64_t needed =
        ZIP_STAT_INDEX | ZIP_STAT_SIZE | ZIP_STAT_COMP_SIZE | ZIP_STAT_COMP_METHOD | ZIP_STAT_ENCRYPTION_METHOD;
    if (zip_stat_index(m_zip.get(), found->second, 0, &result) != 0 || (result.valid & needed) != needed)
        invalid("member '" + member + "' has no size");
    return result;
}

ZipArchive::ZipArchive(std::span<const std::byte> bytes, const std::string& name)
    : m_bytes(bytes), m_name(name), m_zip(nullptr, zip_discard)
{
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
    m_zip.reset(source ? zip_open_from_source(source, ZIP_RDONLY, &error) : nullptr);
    if (!m_zip) {
        const std::string text = zip_error_strerror(&error);
        zip_error_fini(&error);
        if (source)
            zip_source_free(source);
        constexpr std::byte start[] = {std::byte('P'), std::byte('K'), std::byte(3), std::byte(4)};
        const bool is_cut = bytes.size() >= 4 && std::equal(std::begin(start), std::end(start), bytes.begin());
        invalid(is_cut ? "starts as a zip archive and its end is missing, so it was cut short (" + text + ")"
                       : "not a readable zip archive (" + text + ")");
    }
    zip_error_fini(&error);

    const zip_int64_t count = zip_get_num_entries(m_zip.get(), 0);
    if (count <= 0 || count > kMaxMembers)
        invalid(formatString("archive has %lld members", static_cast<long long>(count)));
    for (zip_int64_t i = 0; i < count; ++i) {
        const char* member = zip_get_name(m_zip.get(), zip_uint64_t(i), ZIP_FL_ENC_RAW);
        if (!member)
            invalid(formatString("member %lld has no name", static_cast<long long>(i)));
        if (!m_index.emplace(member, zip_uint64_t(i)).second)
            invalid(formatString("archive lists the member '%s' twice", member));
        m_members.emplace_back(member);
    }
}

bool ZipArchive::contains(const std::string& member) const
{
    return m_index.count(member) != 0;
}

uint64_t ZipArchive::size(const std::string& member) const
{
    return stat(member).size;
}

uint64_t ZipArchive::contentBytes() const
{
    uint64_t sum = 0;
    for (const std::string& member : m_members)
        sum += std::min<uint64_t>(size(member), kMostInflated * m_bytes.size());
    return sum;
}

std::vector<std::byte> ZipArchive::read(const std::string& member) const
{
    const zip_stat_t info = stat(member);
    const bool stored = info.comp_method == ZIP_CM_STORE;
    if ((!stored && info.comp_method != ZIP_CM_DEFLATE) || info.encryption_method != ZIP_EM_NONE)
        throw Error(ErrorCode::Unsupported, m_name,
                    formatString("member '%s' is compressed in a way of its own or encrypted (method %u)",
                                 member.c_str(), unsigned(info.comp_method)),
                    "a member as PyTorch writes it", "save it again with torch.save or torch.jit.save");
    // note: checked before anything is allocated. A stored member cannot be larger than the archive, and deflate makes
    // at most 1032 bytes of one.
    if (info.size / (stored ? 1 : kMostInflated) > std::min<uint64_t>(m_bytes.size(), info.comp_size))
        invalid(formatString("member '%s' claims %llu bytes, the archive has %zu", member.c_str(),
                             static_cast<unsigned long long>(info.size), m_bytes.size()));

    std::vector<std::byte> content(info.size);
    zip_file_t* file = zip_fopen_index(m_zip.get(), info.index, 0);
    if (!file)
        invalid("member '" + member + "' is damaged (" + zip_strerror(m_zip.get()) + ")");
    const zip_int64_t got = zip_fread(file, content.data(), content.size());
    std::byte beyond{};
    // libzip checks the CRC when it is asked for a byte beyond the end
    const zip_int64_t rest = got < 0 ? -1 : zip_fread(file, &beyond, 1);
    const std::string text = got < 0 || rest < 0 ? zip_file_strerror(file) : "its size differs from the directory's";
    zip_fclose(file);
    if (got != zip_int64_t(content.size()) || rest != 0)
        invalid("member '" + member + "' is damaged (" + text + ")");
    return content;
}

} // namespace gsc
