// Tables of drives, as identify makes them of bags and as users without ROS write them.

#include "youbot_base_sim/identify/drive_table.h"

#include <gtest/gtest.h>

#include "errors.h"
#include "program.h"

namespace youbot_base_sim {
namespace {

const std::string kHeader =
    "t,phi_fl,phi_fr,phi_bl,phi_br,dphi_fl,dphi_fr,dphi_bl,dphi_br,command_fl,command_fr,"
    "command_bl,command_br,x,y,psi,remark\n";

class DriveTableTest : public testing::Test {
 protected:
  DriveRecord read(const std::string& text) { return read_drive_table(folder_.write("drive.csv", text), "drive"); }

  void expect_refused(const std::string& text, const std::string& message) {
    EXPECT_EQ(error_of<UnusableRecord>([&] { read(text); }), message);
  }

  TemporaryFolder folder_;
};

TEST_F(DriveTableTest, HasEachGroupAtItsOwnTimesFromTheFirstAngles) {
  const DriveRecord record = read(kHeader +
                                  "9.5,,,,,,,,,1,2,3,4,,,,started\r\n"
                                  "10,1,2,3,4,5,6,7,8,,,,,,,,\r\n"
                                  "10,,,,,,,,,,,,,0.5,-1,3,\r\n"
                                  "10.02,1.1,2.1,3.1,4.1,5,6,7,8,,,,,,,,\r\n"
                                  "10.1,,,,,,,,,,,,,0.6,-1,3.5,\r\n");
  EXPECT_EQ(record.name, "drive");
  ASSERT_EQ(record.t.size(), 2u);
  EXPECT_NEAR(record.t[1], 0.02, 1e-12);
  EXPECT_TRUE((record.phi[1] == Wheels(1.1, 2.1, 3.1, 4.1)).all());
  EXPECT_TRUE((record.dphi[0] == Wheels(5, 6, 7, 8)).all());
  EXPECT_FALSE(record.has_torque() || record.rates_from_angles);
  EXPECT_EQ(record.commands.t, std::vector<double>{-0.5});
  EXPECT_TRUE((record.commands.values[0] == Wheels(1, 2, 3, 4)).all());
  ASSERT_EQ(record.truth.size(), 2u);
  EXPECT_EQ(record.truth[0], Eigen::Vector3d(0.5, -1, 3));
  EXPECT_NEAR(record.truth_t[1], 0.1, 1e-12);
  EXPECT_TRUE(record.is_tracked(0.05));
}

TEST_F(DriveTableTest, DifferentiatesAnglesWithoutRates) {
  const DriveRecord record = read("phi_br,t,phi_fl,phi_fr,phi_bl\n4,0,1,2,3\n5,0.5,1,4,3\n7,1,1,4,0\n");
  EXPECT_TRUE(record.rates_from_angles);
  EXPECT_TRUE((record.dphi[0] == Wheels(0, 4, 0, 2)).all());
  EXPECT_TRUE((record.dphi[1] == Wheels(0, 2, -3, 3)).all());
  EXPECT_TRUE((record.dphi[2] == Wheels(0, 0, -6, 4)).all());
}

TEST_F(DriveTableTest, RefusesWithTheLine) {
  const std::string angles = "t,phi_fl,phi_fr,phi_bl,phi_br\n";
  expect_refused("", "drive: header: must have t and phi_fl to phi_br");
  expect_refused("t,phi_fl\n", "drive: header: must have phi_fl, phi_fr, phi_bl, phi_br or none of them");
  expect_refused(angles, "drive: no rows with angles of the wheels");
  expect_refused(angles + "0,1,2,3\n", "drive:2: 4 cells; must be 5");
  expect_refused(angles + "0,1,2,3,x\n", "drive:2: phi_br = x: must be a finite number from -1e+09 to 1e+09");
  expect_refused(angles + "0,1,2,3,\n", "drive:2: phi_br = : must be a finite number from -1e+09 to 1e+09");
  expect_refused(angles + "0,1,2,3,nan\n", "drive:2: phi_br = nan: must be a finite number from -1e+09 to 1e+09");
  expect_refused(angles + ",1,2,3,4\n", "drive:2: must have t");
  expect_refused(angles + "1,1,2,3,4\n1,1,2,3,4\n", "drive:3: t = 1: must be greater than the row's before, 1");
  expect_refused(kHeader + "0,1,2,3,4,,,,,,,,,,,,\n", "drive:2: must have all of phi, dphi and torque, or none");
  EXPECT_EQ(error_of<UnusableRecord>([&] { read_drive_table(folder_.path("."), "drive"); }),
            "drive is a folder; must be a table");
}

}  // namespace
}  // namespace youbot_base_sim
