// SPDX-License-Identifier: Apache-2.0
// The reader of archives: whatever the bytes are, it answers, it takes no more memory than kMaxExpansion allows, and what
// it calls good opens or is refused as any file. The mutator changes fields of small archives, and mostly makes the
// checksums fit again; the rest of the time bytes are just bytes.
#include "tests/format/tiny_archive.h"
#include "tests/fuzz/input_limit.h"

#include "format/archive/archive.h"
#include <gsc/gsc_issues.h>
#include <gsc/gsc_reader.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

namespace {

std::vector<std::byte> freshArchive(uint64_t kind)
{
    gsc::test::TinyGscOptions o;
    o.anchors = 40;
    o.feat_dim = 4;
    o.n_offsets = 2;
    o.nodes = 2;
    o.levels = kind % 2 ? 2 : 1;
    o.float_positions = kind % 5 == 2;
    o.rotation = o.opacity = o.normal = kind % 7 == 3;
    o.sensitivity = kind % 3 == 1;
    const auto file = kind % 2 ? gsc::test::tinyStepsGsc(o) : gsc::test::tinyGsc(o);
    return gsc::test::archiveOf(file, std::filesystem::temp_directory_path().string(), 1);
}

// Changes up to four fields of the tables or of what is stored.
void mutateFields(std::span<std::byte> file, std::mt19937_64& random)
{
    for (uint64_t n = 1 + random() % 4; n > 0; --n) {
        std::span<std::byte> target = file;
        const std::span<gsc::ArchivePart> parts = gsc::test::archiveParts(file);
        if (random() % 4 == 0)
            target = gsc::test::section(file, gsc::kSectionParts);
        else if (random() % 8 != 0 && !parts.empty())
            target = gsc::test::storedPart(file, parts[random() % parts.size()]);
        if (random() % 2) // the records of streams lie first
            target = target.first(std::min<size_t>(target.size(), 5 * sizeof(gsc::ArchiveStream)));
        const size_t width = size_t(1) << random() % 4;
        if (target.size() < width)
            continue;
        const size_t at = random() % (target.size() / width) * width;
        uint64_t value = 0;
        std::memcpy(&value, target.data() + at, width);
        const uint64_t values[] = {0,         ~0ull,   value + random() % 9 - 4, value ^ 1ull << random() % 64,
                                   value * 2, random()};
        value = values[random() % std::size(values)];
        std::memcpy(target.data() + at, &value, width);
    }
}

} // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv)
{
    gsc::test::limitInputs(argc, argv, 65536); // the smallest archive has three pages
    return 0;
}

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size, unsigned int seed)
{
    std::mt19937_64 random(seed);
    if (size <= sizeof(gsc::FileHeader) || random() % 50 == 0) {
        static const std::vector<std::byte> kFresh[] = {freshArchive(0), freshArchive(1), freshArchive(2),
                                                        freshArchive(3)};
        const std::vector<std::byte>& fresh = kFresh[random() % std::size(kFresh)];
        if (fresh.size() > max_size)
            return LLVMFuzzerMutate(data, size, max_size);
        std::memcpy(data, fresh.data(), fresh.size());
        return fresh.size();
    }
    if (random() % 8 == 0)
        size = LLVMFuzzerMutate(data, size, max_size);
    const std::span<std::byte> file(reinterpret_cast<std::byte*>(data), size);
    mutateFields(file, random);
    if (random() % 8 != 0)
        gsc::test::resealArchive(file);
    return size;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size)
{
    const std::span<const std::byte> file(reinterpret_cast<const std::byte*>(data), size);
    bool error = false;
    const gsc::IssueSink sink = [&](const gsc::Issue& issue) {
        error |= issue.info->severity != gsc::Severity::Warning;
        if (issue.detail.empty())
            std::abort();
    };
    const gsc::Archive archive(file, sink);
    if (archive.isSound() == error)
        std::abort();
    if (!archive.isSound())
        return 0;
    const uint64_t most =
        2 * (size * gsc::kMaxExpansion + archive.parts().size() * (gsc::kFreeExpansion + gsc::kSectionAlign));
    if (archive.rawBytes() > most)
        std::abort();
    if (archive.rawBytes() > (64u << 20))
        return 0;
    const gsc::test::AlignedRoom room(archive.rawBytes());
    const std::span<std::byte> out = room.bytes();
    const bool good = archive.decode(out, gsc::Archive::Scope::All, 1, sink);
    if (good == error)
        std::abort();
    gsc::GscView view;
    if (good)
        gsc::openGsc(out, view, gsc::GscCheck::Full, nullptr);
    return 0;
}
