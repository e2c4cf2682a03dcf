// places_file_test.cpp: tables of places, as numpy and spreadsheets write them.
#include "tools/commands/places_file.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tools/run_clamor.h"

namespace clamor {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct Table {
  explicit Table(const std::string& content) : path(folder.write("grid.csv", content)) {}
  const testing::Folder folder;
  const std::string path;
};

TEST(PlacesFile, HoldsAPlaceOnEachLineWithOrWithoutAName) {
  const Table table(
      "\xEF\xBB\xBFx,y,z,name\r\n"
      "# of the first row\r\n"
      "0,1.7,3,row 1 seat 2\r\n"
      "\r\n"
      " -2.5 , 1e0 ,\t4.25\n"
      "1,2,3, b\xC3\xBChne ");
  const auto places = read_places(table.path);
  ASSERT_TRUE(places.ok()) << places.error().message;
  ASSERT_EQ(places->size(), 3u);
  EXPECT_EQ((*places)[0].at_m, Vec3(0, 1.7, 3));
  EXPECT_EQ((*places)[0].name, "row 1 seat 2");
  EXPECT_EQ((*places)[1].at_m, Vec3(-2.5, 1, 4.25));
  EXPECT_EQ((*places)[1].name, "");
  EXPECT_EQ((*places)[2].name, "b\xC3\xBChne");
}

TEST(PlacesFile, IsRefusedWithTheLineThatIsWrong) {
  for (const auto& [line, says] :
       {std::pair<std::string, std::string>{"1,2", "is not X,Y,Z or X,Y,Z,NAME"},
        {"1,2,nan", "is not X,Y,Z or X,Y,Z,NAME"},
        {"1 2 3", "is not X,Y,Z or X,Y,Z,NAME"},
        {"1;2;3", "is not X,Y,Z or X,Y,Z,NAME"},
        {"x,y,z", "is not X,Y,Z or X,Y,Z,NAME"},
        {"1,2,1e9", "100 000 km"},
        {"1,2,3,", "cannot be a name"},
        {"1,2,3,a,b", "cannot be a name"},
        {"1,2,3,../up", "cannot be a name"},
        {"1,2,3,.hidden", "cannot be a name"},
        {"1,2,3,a\x1b[2Jb", "cannot be a name"},
        {"1,2,3," + std::string(201, 'a'), "cannot be a name"}}) {
    const auto places = read_places(Table("0,0,0\n" + line + "\n0,0,1\n").path);
    ASSERT_FALSE(places.ok()) << line;
    EXPECT_THAT(places.error().message, AllOf(HasSubstr("grid.csv: line 2"), HasSubstr(says)));
  }
}

TEST(PlacesFile, WithoutAPlaceOrThatCannotBeReadIsNamed) {
  EXPECT_THAT(read_places(Table("x,y,z\n# none\n").path).error().message,
              HasSubstr("has no place"));
  EXPECT_THAT(read_places("/no/such.csv").error().message,
              HasSubstr("/no/such.csv: cannot be read"));
  EXPECT_THAT(read_places("/").error().message, HasSubstr("/: cannot be read"));
}

TEST(PlacesFile, NamesPlacesByTheirNumbers) {
  std::vector<NamedPlace> places(10);
  places[1].name = "door";
  ASSERT_TRUE(complete_names(places).ok());
  std::vector<std::string> names;
  for (const NamedPlace& place : places) names.push_back(place.name);
  EXPECT_THAT(names, ElementsAre("01", "door", "03", "04", "05", "06", "07", "08", "09", "10"));
}

TEST(PlacesFile, RefusesANameThatIsGivenTwice) {
  std::vector<NamedPlace> places = {{{0, 0, 0}, "door"}, {{0, 0, 1}, "door"}};
  EXPECT_THAT(complete_names(places).error().message, HasSubstr("'door'"));
  places = {{{0, 0, 0}, "2"}, {{0, 0, 1}, ""}};
  EXPECT_FALSE(complete_names(places).ok());
}

}  // namespace
}  // namespace clamor
