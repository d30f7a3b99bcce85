// SPDX-License-Identifier: Apache-2.0
#include "tests/format/mutation.h"

#include <gsc/checksum.h>

namespace gsc::test {

Bytes mutate(const Mutation& mutation)
{
    Bytes file = tinyGsc(mutation.options);
    mutation.apply(file);
    if (mutation.seal == Seal::All)
        reseal(file);
    else if (mutation.seal == Seal::Header)
        resealHeader(file);
    return file;
}

Verdict check(std::span<const std::byte> file, GscCheck level)
{
    const HeapCopy copy(file);
    Verdict verdict{};
    GscView view;
    verdict.good = openGsc(copy.bytes(), view, level, [&](const Issue& issue) {
        verdict.ids.insert(issue.info->id);
        verdict.issues.push_back(issue);
    });
    return verdict;
}

void resealHeader(std::span<std::byte> file)
{
    FileHeader copy = header(file);
    copy.header_checksum = 0;
    Checksum64 sum;
    sum.update(std::as_bytes(std::span(&copy, 1)));
    sum.update(file.subspan(sizeof(FileHeader), copy.section_count * sizeof(SectionEntry)));
    header(file).header_checksum = sum.digest();
}

} // namespace gsc::test
