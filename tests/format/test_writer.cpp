// SPDX-License-Identifier: Apache-2.0
// The writer: the bytes it promises, and nothing left behind when it cannot keep the promise.
#include "tests/support/in_child.h"
#include "tests/format/mutation.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/outcome.h"

#include <gsc/error.h>
#include <gsc/gsc_writer.h>
#include <gsc/interrupt.h>
#include <gsc/file/mapped_file.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <thread>

#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

using namespace gsc;
using namespace gsc::test;

namespace {

// Writes the sections of `file` with the writer under test, payloads in any order.
void rewrite(Bytes& file, GscWriter& writer)
{
    const std::vector<TinySection> sections = takeApart(file);
    const std::vector<std::byte>& payloads = sections.front().content;
    writer.reserveAnchors(payloads.size());
    const ChunkRecord* const chunks = records<ChunkRecord>(file, kSectionChunks);
    for (size_t i = section(file, kSectionChunks).size() / sizeof(ChunkRecord); i-- > 0;)
        writer.writeAnchors(chunks[i].payload_offset,
                            std::span(payloads).subspan(chunks[i].payload_offset, chunks[i].payload_bytes));
    for (size_t i = 1; i < sections.size(); ++i)
        writer.addSection(sections[i].entry.type, sections[i].content, sections[i].entry.count);
    const uint64_t size = writer.finish(header(file), sections.front().entry.checksum);
    writer.commit();
    CHECK(size == file.size());
}

// A disk of 256 KiB that only this process sees. False where that needs rights we have not.
bool mountSmallDisk(const std::filesystem::path& where)
{
    const uid_t uid = ::geteuid();
    const gid_t gid = ::getegid();
    if (::unshare(uid == 0 ? CLONE_NEWNS : CLONE_NEWNS | CLONE_NEWUSER) != 0)
        return false;
    if (uid != 0) { // files need an owner and a group that the new namespace knows
        std::ofstream("/proc/self/uid_map") << uid << ' ' << uid << " 1";
        std::ofstream("/proc/self/setgroups") << "deny";
        std::ofstream("/proc/self/gid_map") << gid << ' ' << gid << " 1";
    }
    return ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
           ::mount("none", where.c_str(), "tmpfs", 0, "size=256k") == 0;
}

} // namespace

TEST_CASE("writer and in-memory builder agree to the byte")
{
    const TemporaryFolder dir;
    TinyGscOptions options;
    options.levels = 2;
    options.appearance_dim = 4;
    options.appearance_rows = 3;
    Bytes file = tinyGsc(options);
    {
        GscWriter writer(dir / "a.gsc", false);
        rewrite(file, writer);
    }
    const MappedFile written(dir / "a.gsc");
    CHECK(std::equal(written.bytes().begin(), written.bytes().end(), file.begin(), file.end()));
    CHECK(check(written.bytes()).issues.empty());
    CHECK(dir.names() == std::vector<std::string>{"a.gsc"});
}

TEST_CASE("an existing file is refused before any work, and replaced only on demand")
{
    const TemporaryFolder dir;
    std::ofstream(dir / "a.gsc") << "precious";
    const Outcome refused = outcomeOf([&] { GscWriter(dir / "a.gsc", false); });
    CHECK(refused.code == ErrorCode::Io);
    CHECK(refused.says("a.gsc: already exists"));
    CHECK(dir.names().size() == 1);
    {
        GscWriter abandoned(dir / "a.gsc", true);
        abandoned.reserveAnchors(1000);
        CHECK(dir.names().size() == 2);
    }
    CHECK(dir.names().size() == 1);
    CHECK(std::filesystem::file_size(dir / "a.gsc") == 8);
    Bytes file = tinyGsc();
    GscWriter writer(dir / "a.gsc", true);
    rewrite(file, writer);
    CHECK(std::filesystem::file_size(dir / "a.gsc") == file.size());
}

TEST_CASE("a file that appears while writing is not replaced")
{
    const TemporaryFolder dir;
    Bytes file = tinyGsc();
    GscWriter writer(dir / "a.gsc", false);
    std::ofstream(dir / "a.gsc") << "precious";
    CHECK(outcomeOf([&] { rewrite(file, writer); }).code == ErrorCode::Io);
    CHECK(std::filesystem::file_size(dir / "a.gsc") == 8);
}

TEST_CASE("targets that cannot be files are refused")
{
    const TemporaryFolder dir;
    CHECK(outcomeOf([&] { GscWriter(dir.path().string(), true); }).code == ErrorCode::Io);
    CHECK(outcomeOf([&] { GscWriter(dir / "absent/a.gsc", false); }).code == ErrorCode::Io);
    CHECK(outcomeOf([&] { GscWriter("/dev/null", true); }).code == ErrorCode::Io);
    CHECK(dir.names().empty());
}

TEST_CASE("an exception leaves nothing behind")
{
    const TemporaryFolder dir;
    Bytes file = tinyGsc();
    CHECK_THROWS([&] {
        GscWriter writer(dir / "a.gsc", false);
        writer.reserveAnchors(4096);
        throw std::runtime_error("somewhere in the converter");
    }());
    CHECK(dir.names().empty());
}

TEST_CASE("ANCH reads back what was written and zeros elsewhere, from many threads")
{
    const TemporaryFolder dir;
    GscWriter writer(dir / "a.gsc", false);
    constexpr uint64_t kBlock = 10'000, kBlocks = 64;
    writer.reserveAnchors(kBlock * kBlocks);
    std::vector<std::thread> threads;
    for (uint64_t t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            for (uint64_t b = t; b < kBlocks; b += 4)
                if (b % 3 != 0)
                    writer.writeAnchors(b * kBlock, std::vector<std::byte>(kBlock, std::byte(b)));
        });
    for (std::thread& thread : threads)
        thread.join();
    std::vector<std::byte> back(kBlock * kBlocks);
    writer.readAnchors(0, back);
    uint64_t wrong = 0;
    for (uint64_t i = 0; i < back.size(); ++i)
        wrong += back[i] != (i / kBlock % 3 != 0 ? std::byte(i / kBlock) : std::byte{0});
    CHECK(wrong == 0);
    CHECK(outcomeOf([&] { writer.writeAnchors(kBlock * kBlocks, std::vector<std::byte>(1)); }).code ==
          ErrorCode::Internal);
    CHECK(outcomeOf([&] { writer.writeAnchors(~0ull, std::vector<std::byte>(2)); }).code == ErrorCode::Internal);
    CHECK(outcomeOf([&] { writer.readAnchors(kBlock * kBlocks - 1, std::span(back).first(2)); }).code ==
          ErrorCode::Internal);
}

TEST_CASE("a write that the system cuts short is an Io error and leaves nothing")
{
    const TemporaryFolder dir;
    const auto limited = [&](const std::function<void(GscWriter&)>& work) {
        return inChild([&] {
            ::signal(SIGXFSZ, SIG_IGN);
            const rlimit limit{100'000, 100'000};
            if (::setrlimit(RLIMIT_FSIZE, &limit) != 0)
                return 98;
            return int(outcomeOf([&] {
                           GscWriter writer(dir / "a.gsc", false);
                           work(writer);
                       }).code);
        });
    };
    CHECK(limited([](GscWriter& w) { w.reserveAnchors(1'000'000); }) == int(ErrorCode::Io));
    CHECK(dir.names().empty());
    CHECK(limited([](GscWriter& w) {
              w.reserveAnchors(1000);
              w.addSection(kSectionIndex, std::vector<std::byte>(1'000'000), 250'000);
          }) == int(ErrorCode::Io));
    CHECK(dir.names().empty());
}

TEST_CASE("a full disk is an Io error and leaves nothing")
{
    const TemporaryFolder dir;
    const auto onSmallDisk = [&](const std::function<void(GscWriter&)>& work) {
        return inChild([&] {
            if (!mountSmallDisk(dir.path()))
                return 97;
            const Outcome outcome = outcomeOf([&] {
                GscWriter writer(dir / "a.gsc", false);
                work(writer);
            });
            if (!dir.names().empty())
                return 96;
            return outcome.says("free some space") ? int(outcome.code) : 95;
        });
    };
    const int reserving = onSmallDisk([](GscWriter& w) { w.reserveAnchors(1'000'000); });
    if (reserving == 97) {
        MESSAGE("skipped: no right to mount a small disk here");
        return;
    }
    CHECK(reserving == int(ErrorCode::Io));
    CHECK(onSmallDisk([](GscWriter& w) {
              w.reserveAnchors(1000);
              w.addSection(kSectionIndex, std::vector<std::byte>(1'000'000), 250'000);
          }) == int(ErrorCode::Io));
}

TEST_CASE("sections in the wrong order are a bug of the caller")
{
    const TemporaryFolder dir;
    GscWriter writer(dir / "a.gsc", false);
    writer.addSection(kSectionMeta, {}, 0);
    CHECK(outcomeOf([&] { writer.reserveAnchors(0); }).code == ErrorCode::Internal);
    for (uint32_t i = 1; i < kMaxSections; ++i)
        writer.addSection(i, {}, 0);
    const Outcome refused = outcomeOf([&] { writer.addSection(kSectionIndex, {}, 0); });
    CHECK(refused.code == ErrorCode::Internal);
    CHECK(refused.says("at most " + std::to_string(kMaxSections)));
}

TEST_CASE("the first interrupt is a request, the second kills")
{
    CHECK(inChild([] {
              installInterruptHandler();
              if (interrupted())
                  return 1;
              throwIfInterrupted();
              ::raise(SIGTERM);
              if (!interrupted())
                  return 2;
              return outcomeOf([] { throwIfInterrupted(); }).code == ErrorCode::Interrupted ? 0 : 3;
          }) == 0);
    CHECK(inChild([] {
              installInterruptHandler();
              ::raise(SIGTERM);
              ::raise(SIGINT);
              return 0;
          }) == -SIGINT);
}

TEST_CASE("a signal that was ignored before stays so, and after an interrupt too")
{
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
        const int other = number == SIGINT ? SIGTERM : SIGINT;
        CHECK(inChild([&] {
                  std::signal(number, SIG_IGN);
                  installInterruptHandler();
                  ::raise(number);
                  if (interrupted())
                      return 1;
                  ::raise(other);
                  if (!interrupted())
                      return 2;
                  ::raise(number);
                  return 0;
              }) == 0);
        CHECK(inChild([&] {
                  std::signal(number, SIG_IGN);
                  installInterruptHandler();
                  ::raise(other);
                  ::raise(other);
                  return 0;
              }) == -other);
    }
}
