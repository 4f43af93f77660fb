#include "base/file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <thread>

#include "base/hash.h"
#include "base/random.h"
#include "base/spool.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

class FileTest : public FolderTest {
 protected:
  std::size_t entries() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
  }
};

TEST_F(FileTest, WritesWholeFilesAndReadsThemBack) {
  const std::string bytes("a\0b\n", 4);
  ASSERT_TRUE(write_file(folder / "new" / "x.bin", bytes).ok());
  const auto back = read_file(folder / "new" / "x.bin");
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(*back, bytes);
}

TEST_F(FileTest, ReplacingLeavesNoTemporary) {
  ASSERT_TRUE(write_file(folder / "x", "one").ok());
  ASSERT_TRUE(write_file(folder / "x", "two").ok());
  EXPECT_EQ(*read_file(folder / "x"), "two");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(FileTest, WhatKilledRunsLeftIsRemovedAfterADay) {
  const auto now = fs::file_time_type::clock::now();
  const auto make = [&](const char* name, int hours) {
    std::ofstream(folder / name) << "half";
    fs::last_write_time(folder / name, now - std::chrono::hours(hours));
  };
  make(".f.0001.exr.0123456789ab.part", 25);
  make(".f.0002.exr.0123456789ab.part", 23);  // its run may be under way
  for (const char* kept : {"f.0001.exr", "f.part", ".f.part", ".0123456789ab.part",
                           ".f.exr.0123456789xy.part", "f.exr.0123456789ab.part"})
    make(kept, 1000);
  remove_old_temporaries(folder);
  EXPECT_FALSE(fs::exists(folder / ".f.0001.exr.0123456789ab.part"));
  EXPECT_EQ(entries(), 7u);
  remove_old_temporaries(folder / "gone");
}

TEST_F(FileTest, ADirectoryIsRefusedBothWays) {
  const auto read = read_file(folder);
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().code, ErrorCode::kInput);
  EXPECT_NE(read.error().message.find("is a directory"), std::string::npos);
  const auto written = write_file(folder, "x");
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.error().code, ErrorCode::kOutput);
}

TEST_F(FileTest, AFifoDoesNotBlock) {
  ASSERT_EQ(::mkfifo((folder / "fifo").c_str(), 0600), 0);
  const auto read = read_file(folder / "fifo");
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().message.find("not a regular file"), std::string::npos);
}

TEST_F(FileTest, AFifoIsWrittenToNotReplaced) {
  const fs::path fifo = folder / "fifo";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  const int reader = ::open(fifo.c_str(), O_RDWR);  // never waits for a writer
  ASSERT_GE(reader, 0);
  EXPECT_TRUE(check_writable(fifo).ok());
  EXPECT_TRUE(write_file(fifo, "data").ok());
  char got[5] = {};
  EXPECT_EQ(::read(reader, got, 4), 4);
  ::close(reader);
  EXPECT_STREQ(got, "data");
  EXPECT_TRUE(fs::is_fifo(fifo));
}

TEST_F(FileTest, WhatARunReadsIsNotWrittenOver) {
  const fs::path read = folder / "read", same = folder / "same", link = folder / "link";
  ASSERT_TRUE(write_file(read, "kept").ok());
  fs::create_hard_link(read, same);
  fs::create_symlink("read", link);
  {
    const InputGuard guard;
    remember_input(folder / "." / "read");
    for (const fs::path& name : {read, same, link}) {
      EXPECT_FALSE(check_output(name, true).ok());
      EXPECT_FALSE(write_files({{name, "new"}}).ok());
      const auto written = write_file(name, "new");
      ASSERT_FALSE(written.ok());
      EXPECT_EQ(written.error().code, ErrorCode::kOutput);
      EXPECT_EQ(*read_file(name), "kept");
    }
    // Another file may have the number of one that is gone.
    fs::remove(read);
    EXPECT_TRUE(write_file(same, "new").ok());
  }
  ASSERT_TRUE(write_file(read, "old").ok());
  remember_input(read);
  EXPECT_TRUE(write_file(read, "new").ok()) << "no run is under way";
}

TEST_F(FileTest, AnOutputThatExistsNeedsLeave) {
  ASSERT_TRUE(write_file(folder / "x", "old").ok());
  EXPECT_FALSE(check_output(folder / "x", false).ok());
  EXPECT_TRUE(check_output(folder / "x", true).ok());
  EXPECT_TRUE(check_output(folder / "y", false).ok());
  EXPECT_TRUE(check_output("/dev/null", false).ok()) << "a device is never replaced";
  ASSERT_EQ(::mkfifo((folder / "fifo").c_str(), 0600), 0);
  const auto unread = write_file(folder / "fifo", "x");
  ASSERT_FALSE(unread.ok());
  EXPECT_NE(unread.error().message.find("nobody reads this pipe"), std::string::npos);
}

TEST_F(FileTest, TooLargeIsRefusedBeforeReading) {
  ASSERT_TRUE(write_file(folder / "x", "12345").ok());
  const auto read = read_file(folder / "x", 4);
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().message.find("too large"), std::string::npos);
}

TEST_F(FileTest, AFileInThePathIsNamed) {
  ASSERT_TRUE(write_file(folder / "x", "1").ok());
  const auto written = write_file(folder / "x" / "y", "1");
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.error().code, ErrorCode::kOutput);
  EXPECT_FALSE(check_writable(folder / "x" / "y").ok());
}

TEST_F(FileTest, CheckWritableMakesNothing) {
  EXPECT_TRUE(check_writable(folder / "a" / "b" / "c.png").ok());
  EXPECT_EQ(entries(), 0u);
}

TEST_F(FileTest, AFullDiskIsAnErrorAndLeavesNothing) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root to mount a small tmpfs";
  const fs::path small = folder / "small";
  fs::create_directory(small);
  if (std::system(("mount -t tmpfs -o size=64k none " + small.string() + " 2>/dev/null").c_str()) !=
      0)
    GTEST_SKIP() << "cannot mount a tmpfs here";
  const auto status = write_file(small / "big", std::string(1 << 20, 'x'));
  const bool empty = fs::is_empty(small);
  EXPECT_EQ(std::system(("umount " + small.string()).c_str()), 0);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kOutput);
  EXPECT_NE(status.error().message.find("No space"), std::string::npos) << status.error().message;
  EXPECT_TRUE(empty);
}

TEST_F(FileTest, SeveralAreWrittenTogether) {
  ASSERT_TRUE(write_file(folder / "a", "old a"));
  ASSERT_TRUE(write_files({{folder / "a", "new a"}, {folder / "b", "new b"}}));
  EXPECT_EQ(*read_file(folder / "a"), "new a");
  EXPECT_EQ(*read_file(folder / "b"), "new b");
  EXPECT_EQ(entries(), 2u) << "neither temporaries nor old files stay";
}

TEST_F(FileTest, SeveralStayAsTheyWereWhenOneCannotBeWritten) {
  ASSERT_TRUE(write_file(folder / "a", "old a"));
  fs::create_directory(folder / "b");
  const auto folder_in_the_way = write_files({{folder / "a", "new a"}, {folder / "b", "new b"}});
  ASSERT_FALSE(folder_in_the_way);
  EXPECT_EQ(folder_in_the_way.error().code, ErrorCode::kOutput);
  EXPECT_EQ(*read_file(folder / "a"), "old a");
  fs::remove(folder / "b");

  // A file that becomes too large: the one before it was written by then.
  const auto before = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit{}, small{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &limit), 0);
  small = limit;
  small.rlim_cur = 100;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const auto full = write_files({{folder / "a", "new a"}, {folder / "b", std::string(200, 'b')}});
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  std::signal(SIGXFSZ, before);
  ASSERT_FALSE(full);
  EXPECT_EQ(*read_file(folder / "a"), "old a");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(FileTest, RenamesThatWereDoneAreUndone) {
  // "c/d" makes a folder where "c" is to be, after both were found writable.
  ASSERT_TRUE(write_file(folder / "a", "old a"));
  fs::create_symlink("nowhere", folder / "link");
  const auto failed = write_files({{folder / "a", "new a"},
                                   {folder / "b", "new b"},
                                   {folder / "link", "no link"},
                                   {folder / "c", "new c"},
                                   {folder / "c" / "d", "new d"}});
  ASSERT_FALSE(failed);
  EXPECT_NE(failed.error().message.find("/c: "), std::string::npos) << failed.error().message;
  EXPECT_EQ(*read_file(folder / "a"), "old a");
  EXPECT_FALSE(fs::exists(folder / "b")) << "it was not there before";
  EXPECT_EQ(fs::read_symlink(folder / "link"), "nowhere");
  EXPECT_TRUE(fs::is_empty(folder / "c"));
  EXPECT_EQ(entries(), 3u);
}

std::atomic<int> signals{0}, signals_after_all{0};
std::string last_file;

TEST_F(FileTest, ASignalWaitsUntilAllAreWritten) {
  std::vector<NewFile> files;
  for (int i = 0; i < 40; ++i)
    files.push_back({folder / std::to_string(i), std::string(1 << 14, 'x')});
  last_file = files.back().path.string();
  const auto before = std::signal(SIGTERM, [](int) {
    ++signals;
    signals_after_all += ::access(last_file.c_str(), F_OK) == 0;
  });
  std::atomic<bool> over = false;
  std::thread sender([&] {
    // The first temporary says that writing has begun.
    while (!over && entries() == 0) std::this_thread::yield();
    if (!over) ::kill(::getpid(), SIGTERM);
  });
  EXPECT_TRUE(write_files(files));
  const std::size_t seen = entries();
  over = true;
  sender.join();
  std::signal(SIGTERM, before);
  EXPECT_EQ(seen, files.size());
  EXPECT_EQ(signals, 1);
  EXPECT_EQ(signals_after_all, 1);
}

TEST(Hasher, DependsOnEveryByteAndOnWhereTextsEnd) {
  const auto hash = [](auto... parts) {
    Hasher hasher;
    (hasher.add(parts), ...);
    return hasher.hex();
  };
  EXPECT_EQ(hash(std::string_view("ab")).size(), 32u);
  EXPECT_EQ(hash(1, 2), hash(1, 2));
  EXPECT_NE(hash(1, 2), hash(2, 1));
  EXPECT_NE(hash(std::string_view("ab"), std::string_view("c")),
            hash(std::string_view("a"), std::string_view("bc")));
}

TEST_F(FileTest, ASpoolGivesItsRunsBackInAnyOrder) {
  auto spool = Spool::create_for(folder / "made" / "x.bin");
  ASSERT_TRUE(spool.ok()) << spool.error().message;
  std::string all;
  for (int i = 0; i < 300000; ++i) all += std::to_string(i) + " ";
  ASSERT_TRUE(spool->append(all).ok());
  ASSERT_TRUE(spool->append("the end").ok());
  EXPECT_EQ(spool->size(), all.size() + 7);
  EXPECT_TRUE(fs::is_empty(folder / "made")) << "it has no name";
  const ByteSource source =
      concatenate({make_source("head "), spool->source({{all.size(), 7}, {0, 0}}),
                   spool->source({{2, all.size() - 2}})});
  ASSERT_TRUE(write_file(folder / "x.bin", source).ok());
  const auto back = read_file(folder / "x.bin");
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(*back, "head the end" + all.substr(2));
}

TEST_F(FileTest, AnErrorOfTheSourceLeavesTheFile) {
  ASSERT_TRUE(write_file(folder / "x.txt", "before").ok());
  int calls = 0;
  const auto status = write_file(folder / "x.txt", [&]() -> Result<std::string_view> {
    if (++calls < 3) return std::string_view("more");
    return Error{ErrorCode::kResource, "gone"};
  });
  EXPECT_EQ(status.error().message, "gone");
  EXPECT_EQ(*read_file(folder / "x.txt"), "before");
  EXPECT_EQ(entries(), 1u);
}

TEST(Random, IsAFunctionOfItsKeysAndFillsItsRange) {
  EXPECT_EQ(random_u64(1, 2, 3), random_u64(1, 2, 3));
  EXPECT_NE(random_u64(1, 2, 3), random_u64(1, 3, 2));
  int seen[5] = {};
  for (std::uint64_t i = 0; i < 5000; ++i) ++seen[random_below(5, 7, 0, i)];
  for (const int n : seen) EXPECT_NEAR(n, 1000, 150);
}

}  // namespace
}  // namespace polymorph
