// SPDX-License-Identifier: Apache-2.0
// A mapped file that is cut short, and one that there is no room for.
#include "tests/support/in_child.h"
#include "tests/support/temporary_folder.h"

#include <gsc/error.h>
#include <gsc/file/file_fault.h>
#include <gsc/file/mapped_file.h>
#include <gsc/file/output_file.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <thread>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define GSC_TEST_ASAN
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define GSC_TEST_ASAN
#endif

using namespace gsc;
using namespace gsc::test;
namespace fs = std::filesystem;

TEST_CASE("a mapped file that is cut short ends the program with its name, on any thread, and leaves no temporary")
{
    const TemporaryFolder dir;
    const std::string path = dir / "a\"\xff.gsc";
    struct Form {
        bool json, events;
        int stream;
        std::string start, found, end;
    };
    const std::string message = "became shorter while it was read, or its disk failed";
    const std::string plain = "/a\"\xef\xbf\xbd.gsc: " + message, quoted = "/a\\\"\xef\xbf\xbd.gsc: " + message;
    const std::string remedy = "write new versions under another name and rename them";
    for (const Form& form :
         {Form{false, false, STDERR_FILENO, "error: ", plain, remedy + "\n"},
          Form{true, false, STDERR_FILENO, "error: ", plain, remedy + "\n"},
          Form{false, true, STDERR_FILENO, R"({"event":"error","message":")", quoted, remedy + "\"}\n"},
          Form{true, true, STDERR_FILENO, R"({"event":"error","message":")", quoted, remedy + "\"}\n"},
          Form{true, true, STDOUT_FILENO, R"({"schema": "gsc.error/1", "code": "Io", "exit_code": 2, "message": ")",
               quoted,
               R"(", "subject": ")" + dir.path().string() + quoted.substr(0, quoted.find(": ")) + R"(", "found": ")" +
                   message + R"(", "expected": "a file that stays as it is", "remedy": ")" + remedy + "\"}\n"}}) {
        std::ofstream(path) << std::string(1'000'000, 'x');
        std::string printed;
        const int code = inChild(
            [&] {
                installFileFaultHandler(form.json, form.events);
                const MappedFile file(path);
                const OutputFile output(dir / "out", OutputKind::Binary, false);
                fs::resize_file(path, 10);
                std::vector<std::thread> threads;
                for (int i = 0; i < 4; ++i)
                    threads.emplace_back([&] {
                        volatile std::byte last = file.bytes().back();
                        (void)last;
                    });
                for (std::thread& thread : threads)
                    thread.join();
                return 0;
            },
            &printed, form.stream);
        CHECK(code == int(ErrorCode::Io));
        CAPTURE(printed);
        CHECK(printed.starts_with(form.start));
        CHECK(printed.find(form.found) != std::string::npos);
        CHECK(printed.ends_with(form.end));
        CHECK(std::count(printed.begin(), printed.end(), '\n') == 1);
        CHECK(dir.names().size() == 1);
    }
}

TEST_CASE("any other SIGBUS gets its default action")
{
    CHECK(inChild([] {
              std::signal(SIGBUS, SIG_DFL);
              installFileFaultHandler(false, false);
              ::raise(SIGBUS);
              return 0;
          }) == -SIGBUS);
    const TemporaryFolder dir;
    std::ofstream(dir / "a") << std::string(100'000, 'x');
    CHECK(inChild([&] {
              std::signal(SIGBUS, SIG_DFL);
              installFileFaultHandler(false, false);
              const int fd = ::open((dir / "a").c_str(), O_RDONLY);
              const auto* bytes =
                  static_cast<const volatile char*>(::mmap(nullptr, 100'000, PROT_READ, MAP_SHARED, fd, 0));
              fs::resize_file(dir / "a", 0);
              return int(bytes[50'000]); // a mapping of somebody else
          }) == -SIGBUS);
}

#ifndef GSC_TEST_ASAN // ASan needs more address space than the limit leaves
TEST_CASE("no address space for a file is OutOfMemory")
{
    const TemporaryFolder dir;
    std::ofstream(dir / "a") << 1;
    fs::resize_file(dir / "a", uintmax_t(1) << 40); // sparse
    CHECK(inChild([&] {
              const rlimit limit{rlim_t(1) << 36, rlim_t(1) << 36};
              ::setrlimit(RLIMIT_AS, &limit);
              try {
                  const MappedFile file(dir / "a");
              } catch (const Error& e) {
                  return int(e.code());
              }
              return 0;
          }) == int(ErrorCode::OutOfMemory));
}
#endif
