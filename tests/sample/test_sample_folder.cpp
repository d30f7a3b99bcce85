// SPDX-License-Identifier: Apache-2.0
// Leaves a whole model behind, or nothing.
#include <gsc/error.h>
#include <gsc/interrupt.h>
#include "sample/sample_tools.h"
#include "tests/support/in_child.h"

#include <doctest/doctest.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <fstream>

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

using namespace gsc;
using namespace gsc::test;

static bool exchanges = true; // whether a file system can exchange two folders

// In place of the C library's, which hands on what the system says.
extern "C" int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) noexcept
{
    if (exchanges || (flags & RENAME_EXCHANGE) == 0)
        return int(::syscall(SYS_renameat2, from_folder, from, to_folder, to, flags));
    errno = EINVAL;
    return -1;
}

namespace {

SampleOptions small(const std::string& output)
{
    return sampleOptions(SampleScene::City, SampleModel::Scaffold, 3000, output);
}

} // namespace

// note: the two that fork come first, before this process has started TBB's threads
TEST_CASE("sample folder: Ctrl-C leaves nothing")
{
    const TemporaryFolder scratch;
    const int code = inChild([&] {
        installInterruptHandler();
        try {
            makeSample(small(scratch / "model"), [](const char*, uint64_t, uint64_t) {
                if (!interrupted()) // a second signal kills
                    std::raise(SIGINT);
            });
        } catch (const Error& error) {
            return int(error.code());
        }
        return 0;
    });
    CHECK(code == 130);
    CHECK(scratch.names().size() == 0);
}

TEST_CASE("sample folder: a full disk leaves nothing")
{
    const TemporaryFolder scratch;
    const int code = inChild([&] {
        // the limit stands in for the disk: write() fails in the middle of the PLY
        const rlimit limit{300'000, 300'000};
        ::setrlimit(RLIMIT_FSIZE, &limit);
        std::signal(SIGXFSZ, SIG_IGN);
        return int(tryMake(small(scratch / "model")).code);
    });
    CHECK(code == int(ErrorCode::Io));
    CHECK(scratch.names().size() == 0);
}

TEST_CASE("sample folder: an existing folder is refused before any work, and replaced when asked")
{
    const TemporaryFolder scratch;
    const SampleOptions first = small(scratch / "model");
    makeSample(first, {});
    const auto before = hashFolder(first.output);
    SampleOptions again = first;
    again.seed = 7;
    bool worked = false;
    CHECK_THROWS_AS(makeSample(again, [&](const char*, uint64_t, uint64_t) { worked = true; }), Error);
    CHECK_FALSE(worked);
    CHECK(hashFolder(first.output) == before);
    again.overwrite = true;
    makeSample(again, {});
    CHECK(hashFolder(first.output) != before);
    CHECK(scratch.names().size() == 1);
}

TEST_CASE("sample folder: it is replaced, too, where the file system cannot exchange two folders")
{
    const TemporaryFolder scratch;
    SampleOptions options = small(scratch / "model");
    makeSample(options, {});
    const auto before = hashFolder(options.output);
    options.overwrite = true;
    options.seed = 7;
    exchanges = false;
    const Outcome failure = tryMake(options);
    exchanges = true;
    CHECK_MESSAGE(failure.code == ErrorCode::Ok, failure.message);
    CHECK(hashFolder(options.output) != before);
    CHECK(scratch.names().size() == 1); // the old one is gone
}

TEST_CASE("sample folder: what is not a model is never replaced")
{
    const TemporaryFolder scratch;
    std::filesystem::create_directory(scratch / "photos");
    std::ofstream(scratch / "photos/holiday.jpg") << "x";
    SampleOptions options = small(scratch / "photos");
    options.overwrite = true;
    const Outcome failure = tryMake(options);
    CHECK(failure.code == ErrorCode::Usage);
    CHECK(failure.message.find("not a model folder") != std::string::npos);
    CHECK(std::filesystem::exists(scratch / "photos/holiday.jpg"));
    CHECK(tryMake(small("")).code == ErrorCode::Usage);
    CHECK(scratch.names().size() == 1);
}

TEST_CASE("sample folder: a folder that cannot be made is an I/O error")
{
    const TemporaryFolder scratch;
    std::ofstream(scratch / "file") << "x";
    const Outcome failure = tryMake(small(scratch / "file/model"));
    CHECK(failure.code == ErrorCode::Io);
    CHECK(failure.message.find("file") != std::string::npos);
}
