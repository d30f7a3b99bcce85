// SPDX-License-Identifier: Apache-2.0
// Memory of a bake grows with the anchors, by no more than the bounds here.
#include "convert/bake/bake.h"
#include "convert/write/write_gsc.h"
#include "sample/sample_tools.h"
#include "tests/support/sanitized.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>
#include <string>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

using namespace gsc;
using namespace gsc::test;

namespace {

struct Memory {
    double own = 0;    // bytes of this process alone
    double mapped = 0; // bytes of files that it has mapped and read

    // The larger of each.
    void grow(const Memory& other)
    {
        own = std::max(own, other.own);
        mapped = std::max(mapped, other.mapped);
    }
};

Memory memoryNow()
{
    std::ifstream status("/proc/self/status");
    Memory memory;
    for (std::string word; status >> word;)
        if (word == "RssAnon:" || word == "RssFile:") {
            status >> (word == "RssAnon:" ? memory.own : memory.mapped);
            (word == "RssAnon:" ? memory.own : memory.mapped) *= 1024;
        }
    return memory;
}

// The most that a bake of so many anchors holds at the end of a picture.
Memory mostOf(uint64_t anchors)
{
    const TemporaryFolder folder;
    REQUIRE(tryMake(sampleOptions(SampleScene::City, SampleModel::Scaffold, anchors, folder / "model")).code ==
            ErrorCode::Ok);
    WriteOptions convert;
    convert.output = folder / "whole.gsc";
    convert.sensitivity = SensitivityMode::None;
    convert.threads = 1;
    Checkpoint checkpoint = readCheckpoint(folder / "model", {});
    // what a renderer takes depends on what it sees, and is to be little here
    for (SourceCamera& camera : checkpoint.cameras) {
        camera.fx *= 30;
        camera.fy *= 30;
    }
    (void)writeGsc(checkpoint, convert, {});
    BakeOptions options;
    options.input = options.name = convert.output;
    options.output = folder / "baked.gsc";
    options.threads = 1; // each thread has memory of its own, which is none of the anchors'
    options.limits = {4, 2, 2, 10'000};
    options.device = {"cpu"};
    options.target_psnr = 30;
    options.min_view_psnr = 10;
    Memory most;
    (void)bake(options, [&](const char*, uint64_t, uint64_t) { most.grow(memoryNow()); });
    return most;
}

} // namespace

TEST_CASE("after each picture a bake holds no more memory for an anchor than it did")
{
    if (memoryNow().own == 0 || isSanitized())
        return; // no Linux, or memory that is the sanitizer's
#if defined(__GLIBC__)
    mallopt(M_MMAP_THRESHOLD, 1 << 16); // freed memory is given back, so that held memory can be measured
#endif
    constexpr double kFew = 40'000, kMany = 120'000;
    (void)mostOf(2'000); // the first loads what every later one finds there
    const Memory few = mostOf(uint64_t(kFew)), many = mostOf(uint64_t(kMany));
    // 272 bytes of values as they were rounded, 90 of importance, 12 of marks and numbers, 7 of runs and groups: 381
    const double own = (many.own - few.own) / (kMany - kFew);
    CHECK(own > 350); // or it is not measured
    CHECK(own < 400);
    // the source is mapped once, and let go after every picture
    CHECK((many.mapped - few.mapped) / (kMany - kFew) < 30);
}
