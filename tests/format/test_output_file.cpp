// SPDX-License-Identifier: Apache-2.0
// Promises of every output: links, modes, leftovers of killed programs, lines that stay whole.
#include "tests/support/in_child.h"
#include "tests/support/outcome.h"
#include "tests/support/temporary_folder.h"

#include <gsc/error.h>
#include <gsc/file/output_file.h>
#include "format/file/temporary.h"
#include "format/file/trained_model.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <functional>
#include <sstream>

#include <fcntl.h>
#include <grp.h>
#include <sched.h>
#include <sys/file.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

using namespace gsc;
using namespace gsc::test;
namespace fs = std::filesystem;

namespace {

std::string textOf(const std::string& path)
{
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
}

Outcome tryWrite(const std::string& path, OutputKind kind = OutputKind::Text, bool overwrite = true)
{
    return outcomeOf([&] {
        OutputFile file(path, kind, overwrite);
        file.write("new");
        file.commit();
    });
}

bool endsInBrace(std::string_view line)
{
    return line.ends_with('}');
}

mode_t modeOf(const std::string& path)
{
    struct stat info {};
    REQUIRE(::stat(path.c_str(), &info) == 0);
    return info.st_mode & 07777;
}

} // namespace

TEST_CASE("a link is written through: absolute, relative, in a chain, to nothing yet")
{
    const TemporaryFolder dir;
    fs::create_directories(dir / "data/deep");
    std::ofstream(dir / "data/old") << "old";
    fs::create_symlink(dir / "data/old", dir / "absolute");
    fs::create_symlink("../old", dir / "data/deep/relative");
    fs::create_symlink("data/deep/relative", dir / "chain");
    fs::create_symlink("data/dangling", dir / "nothing");
    for (const char* name : {"absolute", "data/deep/relative", "chain"}) {
        CAPTURE(name);
        std::ofstream(dir / "data/old") << "old";
        CHECK(tryWrite(dir / name).code == ErrorCode::Ok);
        CHECK(fs::is_symlink(dir / name));
        CHECK(textOf(dir / "data/old") == "new");
        CHECK(tryWrite(dir / name, OutputKind::Text, false).message.find("already exists") != std::string::npos);
    }
    CHECK(tryWrite(dir / "nothing", OutputKind::Binary, false).code == ErrorCode::Ok);
    CHECK(fs::is_symlink(dir / "nothing"));
    CHECK(textOf(dir / "data/dangling") == "new");
    CHECK(std::distance(fs::directory_iterator(dir / "data"), fs::directory_iterator()) == 3);
}

TEST_CASE("what cannot be a file is refused with its name, and nothing is left")
{
    const TemporaryFolder dir;
    fs::create_directory(dir / "folder");
    REQUIRE(::mkfifo((dir / "pipe").c_str(), 0600) == 0);
    fs::create_symlink("loop", dir / "loop");
    fs::create_symlink("folder", dir / "to-folder");
    fs::create_symlink("/dev/null", dir / "to-device");
    fs::create_symlink("/dev/stdout", dir / "to-stdout");
    fs::create_symlink("pipe", dir / "to-pipe");
    const int server = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{AF_UNIX, {}};
    std::copy_n((dir / "socket").c_str(), (dir / "socket").size(), address.sun_path);
    REQUIRE(::bind(server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0);
    const size_t before = dir.names().size();
    for (const std::string& path : {dir.path().string(),
                                    dir / "folder/",
                                    dir / "pipe",
                                    dir / "loop",
                                    dir / "to-folder",
                                    dir / "to-device",
                                    dir / "to-stdout",
                                    dir / "to-pipe",
                                    dir / "socket",
                                    dir / "new/",
                                    dir / "none/a",
                                    std::string("/dev/null"),
                                    std::string("/dev/stdout"),
                                    std::string("/dev/stderr"),
                                    std::string("/dev/fd/1"),
                                    std::string("/proc/self/fd/1"),
                                    std::string("/proc/self/fd/77"),
                                    std::string("/dev/no-such-device"),
                                    dir / "pipe/a",
                                    dir / std::string(5000, 'x')}) {
        CAPTURE(path);
        for (const OutputKind kind : {OutputKind::Text, OutputKind::Binary}) {
            const Outcome outcome = tryWrite(path, kind);
            CHECK(outcome.code == ErrorCode::Io);
            CHECK(outcome.message.find(path + ": ") == 0);
            CHECK(outcome.message.find(", expected ") != std::string::npos);
            CHECK(outcome.message.find("; ") != std::string::npos);
        }
        CHECK(dir.names().size() == before);
    }
    ::close(server);
    CHECK(tryWrite("").code == ErrorCode::Io);
    CHECK(tryWrite("/dev/stdout").message.find("- for standard output") != std::string::npos);
    CHECK(fs::is_character_file("/dev/null"));
}

TEST_CASE("a descriptor that is redirected to a file is refused all the same")
{
    const TemporaryFolder dir;
    const int fd = ::open((dir / "target").c_str(), O_WRONLY | O_CREAT, 0600);
    REQUIRE(fd >= 0);
    CHECK(tryWrite("/proc/self/fd/" + std::to_string(fd)).code == ErrorCode::Io);
    CHECK(tryWrite("/dev/fd/" + std::to_string(fd)).code == ErrorCode::Io);
    ::close(fd);
    CHECK(textOf(dir / "target").empty());
}

TEST_CASE("a folder that may not be written is an error before any work")
{
    const TemporaryFolder dir;
    fs::create_directory(dir / "closed");
    fs::create_symlink("closed/a", dir / "link");
    fs::permissions(dir / "closed", fs::perms(0555));
    fs::permissions(dir.path(), fs::perms::all);
    const auto check = [&] {
        for (const char* name : {"closed/a", "link"}) {
            const Outcome outcome = outcomeOf([&] { checkOutput(dir / name, OutputKind::Text, true); });
            if (outcome.code != ErrorCode::Io ||
                outcome.message.find("its folder cannot be written") == std::string::npos)
                return 1;
        }
        return 0;
    };
    // root may write everywhere
    CHECK(inChild([&] { return ::geteuid() == 0 && ::setuid(65534) != 0 ? 2 : check(); }) == 0);
    fs::permissions(dir / "closed", fs::perms::owner_all);
}

TEST_CASE("names of any bytes and of the greatest length work")
{
    const TemporaryFolder dir;
    for (const std::string& name :
         {std::string("\xff\x80 \n.gsc"), std::string(255, 'n'), std::string("-"), std::string("..dots")}) {
        CHECK(tryWrite(dir / name, OutputKind::Binary, false).code == ErrorCode::Ok);
        CHECK(textOf(dir / name) == "new");
    }
    CHECK(tryWrite("-", OutputKind::Binary).code == ErrorCode::Usage);
    CHECK(dir.names().size() == 4);
}

TEST_CASE("standard output takes a text as it comes")
{
    std::string printed;
    const int code = inChild([] { return int(tryWrite("-").code); }, &printed, STDOUT_FILENO);
    CHECK(code == 0);
    CHECK(printed == "new");
    CHECK_FALSE(fs::exists("-"));
}

TEST_CASE("a line for standard output goes there")
{
    std::string printed;
    const int code = inChild([] { return appendLine("-", "{}", "{", endsInBrace), 0; }, &printed, STDOUT_FILENO);
    CHECK(code == 0);
    CHECK(printed == "{}\n");
    CHECK_FALSE(fs::exists("-"));
}

TEST_CASE("no descriptor stays open")
{
    const auto opened = [] { return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator()); };
    const TemporaryFolder dir;
    const auto before = opened();
    for (int i = 0; i < 8; ++i) {
        CHECK(tryWrite(dir / "a").code == ErrorCode::Ok);
        CHECK(tryWrite(dir / "a", OutputKind::Text, false).code == ErrorCode::Io);
        {
            const OutputFile given_up(dir / "b", OutputKind::Text, true);
        }
        appendLine(dir / "rows", "{}", "{", endsInBrace);
        CHECK(outcomeOf([&] { appendLine(dir / "a", "{}", "{", endsInBrace); }).code == ErrorCode::InvalidFile);
    }
    CHECK(opened() == before);
}

TEST_CASE("a new file follows the umask, one that is replaced keeps its bits")
{
    const TemporaryFolder dir;
    const mode_t mask = ::umask(027);
    CHECK(tryWrite(dir / "new").code == ErrorCode::Ok);
    CHECK(modeOf(dir / "new") == 0640);
    for (const mode_t mode : {0600, 0444, 0664}) {
        REQUIRE(::chmod((dir / "new").c_str(), mode) == 0);
        CHECK(tryWrite(dir / "new").code == ErrorCode::Ok);
        CHECK(modeOf(dir / "new") == mode);
    }
    REQUIRE(::chmod((dir / "new").c_str(), 0600) == 0);
    const OutputFile file(dir / "new", OutputKind::Text, true); // nobody reads it meanwhile
    struct stat info {};
    REQUIRE(::fstat(file.descriptor(), &info) == 0);
    CHECK((info.st_mode & 0777) == 0600);
    ::umask(mask);
}

TEST_CASE("a file of somebody else keeps its group where it can, and else gives no group anything")
{
    const TemporaryFolder dir;
    fs::permissions(dir.path(), fs::perms::all);
    const std::string path = dir / "shared";
    if (::geteuid() != 0) // who alone can make such a file
        return;
    const auto replaceAs = [&](mode_t mode, std::vector<gid_t> groups) {
        std::ofstream(path) << "old";
        REQUIRE(::chown(path.c_str(), 0, 4321) == 0);
        REQUIRE(::chmod(path.c_str(), mode) == 0);
        REQUIRE(inChild([&] {
                    if (::setgroups(groups.size(), groups.data()) != 0 || ::setgid(65534) != 0 || ::setuid(65534) != 0)
                        return 2;
                    return int(tryWrite(path).code);
                }) == 0);
        struct stat info {};
        REQUIRE(::stat(path.c_str(), &info) == 0);
        CHECK(info.st_uid == 65534);
        CHECK(textOf(path) == "new");
        return std::pair(info.st_gid, info.st_mode & 07777);
    };
    for (const auto& [owner, group] : {std::pair<uid_t, gid_t>(0, 4321), {4321, 0}, {4321, 4321}}) { // root keeps both
        std::ofstream(path) << "old";
        REQUIRE(::chown(path.c_str(), owner, group) == 0);
        CHECK(tryWrite(path).code == ErrorCode::Ok);
        struct stat info {};
        REQUIRE(::stat(path.c_str(), &info) == 0);
        CHECK(info.st_uid == owner);
        CHECK(info.st_gid == group);
    }
    CHECK(replaceAs(0660, {4321}) == std::pair(gid_t(4321), mode_t(0660)));
    CHECK(replaceAs(0660, {}) == std::pair(gid_t(65534), mode_t(0600)));
    CHECK(replaceAs(0664, {}) == std::pair(gid_t(65534), mode_t(0604)));
    CHECK(replaceAs(0604, {}) == std::pair(gid_t(65534), mode_t(0600))); // the old group is now among the others
}

TEST_CASE("a text replaces another only where it may")
{
    const TemporaryFolder dir;
    writeTextFile(dir / "a", "old", false);
    const Outcome outcome = outcomeOf([&] { writeTextFile(dir / "a", "new", false); });
    CHECK(outcome.code == ErrorCode::Io);
    CHECK(outcome.message.find("have it replaced") != std::string::npos);
    CHECK(textOf(dir / "a") == "old");
    writeTextFile(dir / "a", "new", true);
    CHECK(textOf(dir / "a") == "new");
}

TEST_CASE("a mount point says what it is")
{
    const auto says = [](const std::string& path, const Outcome& outcome) {
        return outcome.code == ErrorCode::Io && outcome.message.find(path + ": is a mount point or in use (") == 0 &&
               outcome.message.find("), expected a file that can be replaced; write into the folder it lies in, under "
                                    "another name") != std::string::npos;
    };
    CHECK(says("x", outcomeOf([] { failOutput("x", "cannot rename the finished file", EBUSY); })));
    const TemporaryFolder dir;
    std::ofstream(dir / "from") << "old";
    std::ofstream(dir / "to") << "old";
    CHECK(inChild([&] {
              if (::unshare(CLONE_NEWNS) != 0 || ::mount("", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
                  ::mount((dir / "from").c_str(), (dir / "to").c_str(), nullptr, MS_BIND, nullptr) != 0)
                  return 0; // no right to mount
              return says(dir / "to", tryWrite(dir / "to")) ? 0 : 1;
          }) == 0);
    CHECK(textOf(dir / "from") == "old");
    CHECK(dir.names().size() == 2);
}

TEST_CASE("what a killed program left is removed by the next writer, what is anybody's is not")
{
    const TemporaryFolder dir;
    const std::string target = dir / "a.gsc";
    // killed while it wrote a file and a folder
    CHECK(inChild([&] {
              const OutputFile file(target, OutputKind::Binary, false);
              const Temporary folder(dir / "model", TemporaryKind::Folder, 0777);
              fs::create_directories(folder.path() + "/deep");
              std::ofstream(folder.path() + "/deep/file") << "1";
              ::raise(SIGKILL);
              return 0;
          }) == -SIGKILL);
    CHECK(dir.names().size() == 2);
    // alike, but no leftovers of ours
    const std::vector<std::string> others = {".a.gsc.0123456789abcdeg.gsc-tmp", ".a.gsc.0123456789abcde.gsc-tmp",
                                             "a.gsc.0123456789abcdef.gsc-tmp",  ".a.gsc.0123456789abcdef.gsc-tmp~",
                                             ".a.gsc.0123456789abcdef.tmp",     ".0123456789abcdef.gsc-tmp"};
    for (const std::string& name : others)
        std::ofstream(dir / name) << "precious";
    fs::create_symlink("a-file", dir / ".link.0123456789abcdef.gsc-tmp");
    // one that is being written
    const std::string live = dir / ".b.gsc.fedcba9876543210.gsc-tmp";
    const int fd = ::open(live.c_str(), O_RDWR | O_CREAT, 0600);
    REQUIRE(::flock(fd, LOCK_EX | LOCK_NB) == 0);
    CHECK(tryWrite(target).code == ErrorCode::Ok);
    CHECK(dir.names().size() == others.size() + 3);
    for (const std::string& name : others)
        CHECK(fs::exists(dir / name));
    CHECK(fs::exists(live));
    ::close(fd);
}

TEST_CASE("many programs write the same name at once: each comes to its end and one of them wins")
{
    const TemporaryFolder dir;
    std::vector<pid_t> children;
    for (int i = 0; i < 8; ++i) {
        const pid_t child = ::fork();
        REQUIRE(child >= 0);
        if (child == 0) {
            int failed = 0;
            for (int round = 0; round < 25; ++round) {
                // a process looks for leftovers once: a child of its own does so at every round
                const pid_t writer = ::fork();
                if (writer == 0)
                    ::_exit(tryWrite(dir / "a").code == ErrorCode::Ok ? 0 : 1);
                int status = 1;
                ::waitpid(writer, &status, 0);
                failed += status != 0;
            }
            ::_exit(failed);
        }
        children.push_back(child);
    }
    for (const pid_t child : children) {
        int status = 1;
        REQUIRE(::waitpid(child, &status, 0) == child);
        CHECK(status == 0);
    }
    CHECK(dir.names() == std::vector<std::string>{"a"});
    CHECK(textOf(dir / "a") == "new");
}

TEST_CASE("files of a set appear together or not at all")
{
    const TemporaryFolder dir;
    {
        OutputFiles files(false);
        files.makeFolder(dir / "made");
        files.add(dir / "made/a", OutputKind::Text, "a");
        files.add(dir / "b", OutputKind::Text, "b");
        CHECK_FALSE(fs::exists(dir / "b"));
    }
    CHECK(dir.names().empty());
    OutputFiles files(false);
    files.makeFolder(dir / "made");
    files.add(dir / "made/a", OutputKind::Text, "a");
    files.add(dir / "b", OutputKind::Text, "b");
    files.commit();
    CHECK(textOf(dir / "made/a") == "a");
    CHECK(textOf(dir / "b") == "b");
}

TEST_CASE("a line is added to whole lines, through a link, and a half-written last one is cut off")
{
    const TemporaryFolder dir;
    fs::create_symlink("rows", dir / "link");
    constexpr std::string_view kStart = "{\"row\":";
    appendLine(dir / "link", "{\"row\":1}", kStart, endsInBrace);
    CHECK(fs::is_symlink(dir / "link"));
    errno = EINTR; // left by an earlier call
    appendLine(dir / "rows", "{\"row\":2}", kStart, endsInBrace);
    const std::string whole = "{\"row\":1}\n{\"row\":2}\n";
    CHECK(textOf(dir / "rows") == whole);
    for (const std::string tail : {"{\"", "{\"row\":", "{\"row\":3"}) {
        std::ofstream(dir / "rows", std::ios::binary) << whole << tail;
        appendLine(dir / "rows", "{\"row\":4}", kStart, endsInBrace);
        CHECK(textOf(dir / "rows") == whole + "{\"row\":4}\n");
    }
    for (const std::string& tail : {std::string(10'000, 'x'), std::string("{"), std::string("{}")}) {
        std::ofstream(dir / "rows", std::ios::binary) << whole << tail;
        CHECK(outcomeOf([&] { appendLine(dir / "rows", "y", kStart, endsInBrace); }).code == ErrorCode::InvalidFile);
        CHECK(textOf(dir / "rows") == whole + tail);
    }
}

TEST_CASE("a whole last line that lacks its end alone is kept, also where the disk is full")
{
    const TemporaryFolder dir;
    constexpr std::string_view kStart = "{\"row\":";
    for (const std::string before : {"", "{\"row\":0}\n"}) {
        const std::string whole = before + "{\"row\":1}";
        std::ofstream(dir / "rows", std::ios::binary) << whole;
        CHECK(inChild([&] {
                  std::signal(SIGXFSZ, SIG_IGN);
                  const rlimit limit{whole.size() + 4, whole.size() + 4};
                  ::setrlimit(RLIMIT_FSIZE, &limit);
                  return int(outcomeOf([&] { appendLine(dir / "rows", "{\"row\":2}", kStart, endsInBrace); }).code);
              }) == int(ErrorCode::Io));
        CHECK(textOf(dir / "rows") == whole);
        appendLine(dir / "rows", "{\"row\":2}", kStart, endsInBrace);
        CHECK(textOf(dir / "rows") == whole + "\n{\"row\":2}\n");
    }
}

TEST_CASE("lines of many programs do not mix, and a full disk costs no line")
{
    const TemporaryFolder dir;
    std::vector<pid_t> children;
    for (int i = 0; i < 4; ++i)
        if (const pid_t child = ::fork(); child == 0) {
            for (int line = 0; line < 50; ++line)
                appendLine(dir / "rows", "{" + std::string(3000, char('a' + i)), "{", endsInBrace);
            ::_exit(0);
        } else
            children.push_back(child);
    for (const pid_t child : children)
        ::waitpid(child, nullptr, 0);
    std::ifstream rows(dir / "rows");
    size_t count = 0;
    for (std::string line; std::getline(rows, line); ++count)
        CHECK((line.size() == 3001 && line.find_first_not_of(line[1], 1) == std::string::npos));
    CHECK(count == 200);
    const uintmax_t size = fs::file_size(dir / "rows");
    CHECK(inChild([&] {
              std::signal(SIGXFSZ, SIG_IGN);
              const rlimit limit{size + 100, size + 100};
              ::setrlimit(RLIMIT_FSIZE, &limit);
              return int(outcomeOf([&] { appendLine(dir / "rows", std::string(3000, '{'), "{", endsInBrace); }).code);
          }) == int(ErrorCode::Io));
    CHECK(fs::file_size(dir / "rows") == size);
}

TEST_CASE("the temporary file of a model is named as the model was, also by a link")
{
    const TemporaryFolder folder;
    fs::create_directory(folder / "city");
    fs::create_symlink("city", folder / "lnk");
    for (const char* given : {"lnk", "lnk/"})
        CHECK(fs::path(TemporaryGsc(folder / given).path()).filename() == "lnk.gsc");
    CHECK(fs::path(TemporaryGsc(folder / "city").path()).filename() == "city.gsc");
}
