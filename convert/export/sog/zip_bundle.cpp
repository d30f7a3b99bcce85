// SPDX-License-Identifier: Apache-2.0
#include "convert/export/sog/zip_bundle.h"

#include <gsc/error.h>

#include <zip.h>

#include <cstdio>
#include <ctime>
#include <memory>

namespace gsc {

namespace {

// most bytes, with room for the directory; viewers do not read ZIP64
constexpr size_t kMostBytes = 0x7fff0000;

// The first date that a zip can hold, 1 January 1980, as local time, because libzip writes local times.
time_t firstDate()
{
    tm date{};
    date.tm_year = 80;
    date.tm_mday = 1;
    date.tm_isdst = -1;
    return mktime(&date);
}

} // namespace

std::vector<std::byte> zipBundle(const std::vector<std::pair<std::string, std::vector<std::byte>>>& members)
{
    size_t bytes = 0;
    for (const auto& member : members)
        bytes += member.second.size();
    if (bytes > kMostBytes)
        throw Error(ErrorCode::Unsupported, "zip", formatString("%zu bytes", bytes), "less than 2 GiB",
                    "choose a lower --sh or --max-gaussians");
    const auto check = [](bool good) {
        if (!good)
            throw Error(ErrorCode::OutOfMemory, "zip", "no memory", "as much as the file takes",
                        "close other programs");
    };
    // libzip writes into a buffer of its own; zip_source_keep() keeps that after closing
    zip_source_t* const made = zip_source_buffer_create(nullptr, 0, 0, nullptr);
    check(made != nullptr);
    const std::unique_ptr<zip_source_t, void (*)(zip_source_t*)> buffer(made, zip_source_free);
    std::unique_ptr<zip_t, void (*)(zip_t*)> archive(zip_open_from_source(made, ZIP_TRUNCATE, nullptr), zip_discard);
    check(archive != nullptr);
    zip_source_keep(made);
    for (const auto& [name, content] : members) {
        zip_source_t* const source = zip_source_buffer(archive.get(), content.data(), content.size(), 0);
        check(source != nullptr);
        const zip_int64_t index = zip_file_add(archive.get(), name.c_str(), source, ZIP_FL_ENC_UTF_8);
        if (index < 0)
            zip_source_free(source);
        check(index >= 0 && zip_set_file_compression(archive.get(), zip_uint64_t(index), ZIP_CM_STORE, 0) == 0 &&
              zip_file_set_mtime(archive.get(), zip_uint64_t(index), firstDate(), 0) == 0);
    }
    check(zip_close(archive.get()) == 0);
    (void)archive.release(); // zip_close() has freed the archive
    check(zip_source_open(made) == 0 && zip_source_seek(made, 0, SEEK_END) == 0);
    std::vector<std::byte> file(size_t(zip_source_tell(made)));
    const bool whole = zip_source_seek(made, 0, SEEK_SET) == 0 &&
                       zip_source_read(made, file.data(), file.size()) == zip_int64_t(file.size());
    zip_source_close(made);
    check(whole);
    return file;
}

} // namespace gsc
