// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "format/file/stand_in.h"

#include <doctest/doctest.h>

using namespace gsc;

namespace {

// "" where nothing is refused.
std::string said(const std::string& text, const std::string& path = "a/model.gsc")
{
    try {
        refuseStandIn(text, path);
    } catch (const Error& error) {
        const bool packed = std::string(error.what()).find("compressed") != std::string::npos;
        CHECK(error.code() == (packed ? ErrorCode::Unsupported : ErrorCode::InvalidFile));
        return error.what();
    }
    return "";
}

bool says(const std::string& text, const std::string& part, const std::string& path = "a/model.gsc")
{
    return said(text, path).find(part) != std::string::npos;
}

} // namespace

TEST_CASE("stand-ins: Git LFS pointers of every version, and what only mentions one")
{
    const std::string rest = "\noid sha256:0123\nsize 77\n";
    for (const char* version :
         {"version https://git-lfs.github.com/spec/v1", "version https://git-lfs.github.com/spec/v2",
          "version https://hawser.github.com/spec/v1", "version http://git-media.io/v/2",
          "\xef\xbb\xbfversion https://git-lfs.github.com/spec/v1", "\nversion https://git-lfs.github.com/spec/v1"})
        CHECK(says(version + rest, "a Git LFS pointer, expected the file of 77 bytes"));
    const std::string start = "version https://git-lfs.github.com/spec/v1\n";
    CHECK(says(start + "ext-0-foo sha256:1\next-1-bar sha256:2\noid sha256:3\nsize 5\n", "of 5 bytes"));
    CHECK(says(start + "oid sha256:3\r\nsize 5\r\n", "of 5 bytes"));
    CHECK(says(start, "an unknown number of bytes"));
    CHECK(said("# " + start).empty());
    CHECK(said(start + std::string(1000, ' ')).empty()); // Git LFS writes none that long
    CHECK(said("").empty());
}

TEST_CASE("stand-ins: pages, and text that is none")
{
    for (const char* page : {"<!DOCTYPE html>", "<!doctype HTML PUBLIC", " \r\n<HTML lang=en>", "<head>", "<body>x",
                             "<!-- saved -->\n<html>", "<title>Sign in</title>", "<script>", "<meta charset=utf-8>"})
        CHECK(says(page, "is a web page"));
    for (const char* document : {"<?xml version='1.0'?>", "<Error><Code>NoSuchKey"})
        CHECK(says(document, "is an XML document"));
    for (const char* other : {"<", "<hello>", "html", "{\"a\":\"<html>\"}", "Namespace(a='<html>')"})
        CHECK(said(other).empty());
}

TEST_CASE("stand-ins: what servers say instead of a file")
{
    for (const char* answer :
         {"404: Not Found", "404: not found\n", "Not Found", "Not found.\r\n", "404 Not Found", "Entry not found",
          "Repository not found", "403 Forbidden", "Forbidden", "Access denied", "Invalid username or password.",
          "\xef\xbb\xbf{\"message\":\"Not Found\",\"documentation_url\":\"x\",\"status\":\"404\"}",
          "{\n \"message\" : \"Bad credentials\", \"documentation_url\": \"x\"}",
          "{\"error\":\"Repository not found\"}", "{\"error\": \"Access to model a/b is restricted\"}"})
        CHECK_MESSAGE(says(answer, "is an answer of a server, '"), answer);
    for (const char* other : {"404", "Not Founded", "4040: x", "{\"message\": \"hello\"}",
                              "{\"error\": 0.5, \"psnr\": 30}", "{\"a\": \"Not Found\"}", "Forbidden: yes"})
        CHECK_MESSAGE(said(other).empty(), other);
    CHECK(says("Not Found" + std::string(1023 - 9, ' '), "is an answer of a server, '"));
    CHECK(said("Not Found" + std::string(1024 - 9, ' ')).empty()); // no answer is that long
}

TEST_CASE("stand-ins: links that Git left as text are told by the name they end with")
{
    CHECK(says("../b/model.gsc", "the path '../b/model.gsc'"));
    CHECK(says("/data/other name.gsc\n", "symbolic link"));
    CHECK(says("../run/cfg_args", "symbolic link", "m/cfg_args"));
    CHECK(said("../b/model.gsc", "a/b.json").empty());
    CHECK(said("model.gsc").empty()); // a word is no path
    CHECK(said("Namespace(a='x/cfg_args", "m/cfg_args").empty());
    CHECK(said("a/" + std::string(600, 'b') + ".gsc").empty());
}

TEST_CASE("stand-ins: files compressed as a whole, and those that only start so")
{
    const std::string rest(30, '\0');
    CHECK(says("\x1f\x8b\x08" + rest, "gunzip"));
    CHECK(says("\x28\xb5\x2f\xfd" + rest, "zstd"));
    CHECK(says(std::string("\xfd\x37zXZ\0", 6) + rest, "xz"));
    CHECK(says("BZh91AY&SY" + rest, "bzip2"));
    CHECK(says("7z\xbc\xaf\x27\x1c" + rest, "7-Zip"));
    CHECK(says("Rar!\x1a\x07" + rest, "RAR"));
    CHECK(said("BZhello" + rest).empty());
    // cameras.bin of 559,903 cameras, the first of which has the number 1
    CHECK(said(std::string("\x1f\x8b\x08\0\0\0\0\0\1\0\0\0", 12) + rest, "sparse/cameras.bin").empty());
}
